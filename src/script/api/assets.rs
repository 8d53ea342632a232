//! Assets: shapes with a body, friction and visuals.

use std::collections::BTreeMap;

use mlua::{Lua, Table, Value};

use super::{
    joints::{self, ArticulatedSpec},
    shapes::LuaShape,
    visuals::{VisualSpec, visuals_of},
};
use crate::{
    physics::contact::Friction,
    scene::{Asset, Body, SoftMaterial},
    script::{
        schema::{Range, Record, RecordType, Type, make, object::LuaConstructor, one_of, record},
        vm::error::fail,
    },
};

/// A coefficient of friction.
pub(crate) const COEFFICIENT: Type = Type::Number("", Range::closed(0.0, 10.0));
pub(crate) const PASCALS: Type = Type::Number("Pa", Range::POSITIVE);
pub(crate) const POISSON: Type = Type::Number("", Range::below(0.0, 0.5));
pub(crate) const DENSITY: Type = Type::Number("kg/m³", Range::POSITIVE);

record! {
    /// Coulomb friction of a surface. A pair of surfaces has the larger of each coefficient.
    FrictionSpec: "softvt.Friction" as "friction" {
        /// Static coefficient.
        static_mu: f64 = COEFFICIENT => Number(0.6);
        /// Dynamic coefficient, at most the static one.
        dynamic_mu: f64 = COEFFICIENT => Number(0.5);
    }
    /// A finite-element soft body of linear-elastic, isotropic material.
    SoftSpec: "softvt.Soft" as "asset.body", constructor "softvt.soft" {
        /// Young's modulus.
        youngs_pa: f64 = PASCALS;
        /// Poisson's ratio; 0.5 would be incompressible.
        poisson: f64 = POISSON;
        /// Density.
        density: f64 = DENSITY;
        /// Voxels along the longest edge of the bounding box.
        resolution: usize = Type::Integer(Range::closed(1.0, SoftMaterial::MAX_RESOLUTION as f64)) => Integer(6);
        /// Spacing of contact samples where a gripper can reach.
        grasp_spacing: f64 = Type::Number("m", Range::closed(0.0001, 0.02)) => Number(0.00075);
    }
    /// A free rigid body of uniform density.
    RigidSpec: "softvt.Rigid" as "asset.body", constructor "softvt.rigid" {
        /// Density.
        density: f64 = DENSITY;
    }
    /// A fixed body, which never moves.
    StaticSpec: "softvt.Static" as "asset.body", constructor "softvt.static" {}
    /// Scenery: it is drawn and casts shadows, but has no contact.
    ScenerySpec: "softvt.Scenery" as "asset.body", constructor "softvt.scenery" {}
    /// A kind of object. Its shape at rest has its lowest point at z = 0 and its centre on the z axis (see
    /// softvt.Shape:grounded).
    AssetSpec: "softvt.Asset" as "asset", constructor "softvt.asset" {
        /// Name in results and calibration files.
        name: String = Type::Name;
        /// Shape, in metres.
        shape: LuaShape;
        /// Mechanics.
        body: BodySpec;
        /// Friction of its surface.
        friction: FrictionSpec;
        /// Visuals by material id of the shape, from 0; plain grey by default.
        visuals: Option<Vec<VisualSpec>>;
        /// Numbers for experts (grasp height, closure …).
        hints: Option<BTreeMap<String, f64>>;
    }
}

one_of! {
    /// The mechanics of an asset.
    BodySpec {
        Soft(SoftSpec), Rigid(RigidSpec), Articulated(ArticulatedSpec), Static(StaticSpec), Scenery(ScenerySpec),
    }
}

impl From<&FrictionSpec> for Friction {
    fn from(spec: &FrictionSpec) -> Self {
        Self { static_mu: spec.static_mu, dynamic_mu: spec.dynamic_mu }
    }
}

/// The constructor of assets, and those of bodies without parts.
pub(crate) static CONSTRUCTORS: &[LuaConstructor] = &[
    LuaConstructor::with(AssetSpec::RECORD, make_asset),
    LuaConstructor::of(SoftSpec::RECORD),
    LuaConstructor::of(RigidSpec::RECORD),
    LuaConstructor::of(StaticSpec::RECORD),
    LuaConstructor::of(ScenerySpec::RECORD),
];

fn make_asset(lua: &Lua, record: &'static Record, value: &Value) -> mlua::Result<Table> {
    let made = make(lua, record, value)?;
    let FrictionSpec { static_mu, dynamic_mu } = made.raw_get("friction")?;
    match dynamic_mu <= static_mu {
        true => Ok(made),
        false => {
            let message = format!(
                "asset.friction: dynamic_mu {dynamic_mu} is above static_mu {static_mu}; give the larger one to static_mu"
            );
            Err(fail(lua, message))
        }
    }
}

impl AssetSpec {
    pub(crate) fn asset(&self, lua: &Lua) -> mlua::Result<Asset> {
        let friction = Friction::from(&self.friction);
        let body = match &self.body {
            BodySpec::Soft(soft) => Body::Soft(SoftMaterial {
                youngs_pa: soft.youngs_pa,
                poisson: soft.poisson,
                density: soft.density,
                resolution: soft.resolution,
                grasp_spacing: soft.grasp_spacing,
            }),
            BodySpec::Rigid(rigid) => Body::Rigid { density: rigid.density },
            BodySpec::Articulated(parts) => {
                Body::Articulated(joints::parts(lua, parts, self.visuals.as_deref(), friction)?)
            }
            BodySpec::Static(_) => Body::Static,
            BodySpec::Scenery(_) => Body::Scenery,
        };
        let shape = self.shape.copy();
        Ok(Asset {
            name: self.name.clone(),
            visuals: visuals_of(lua, &self.name, self.visuals.as_deref(), &shape)?,
            shape,
            body,
            friction,
            hints: self.hints.clone().unwrap_or_default(),
        })
    }
}
