//! Assets: shapes with a body, friction and visuals.

use std::collections::BTreeMap;

use mlua::{Lua, Table};

use super::envelope::find_calibration;
use super::{
    joints::{self, ArticulatedSpec},
    shapes::LuaShape,
    visuals::visuals_of,
};
use crate::{
    schema::{
        Constructed, HasTable, LuaType, Record, RecordType, Type, ValidationError, check::Checker, functions,
        is_constructed, one_of, record, record_of,
    },
    vm::error::{app_data, fail},
};
use softvt_common::text::format_number;
use softvt_physics::{contact::Friction, fem::ElasticMaterial};
use softvt_rollout::{AssetCache, asset_warnings};
use softvt_scene::{Asset, Body, SoftMaterial, Visual};

pub(crate) const COEFFICIENT: Type = Type::Number("", Friction::COEFFICIENT);
pub(crate) const PASCALS: Type = Type::Number("Pa", ElasticMaterial::YOUNGS_PA);
pub(crate) const POISSON: Type = Type::Number("", ElasticMaterial::POISSON);
pub(crate) const STRAIN: Type = Type::Number("", SoftMaterial::STRAIN);
pub(crate) const DENSITY: Type = Type::Number("kg/m³", ElasticMaterial::DENSITY);

record_of! {
    /// Coulomb friction of a surface. A pair of surfaces has the larger of each coefficient, unless one is coated.
    Friction: "softvt.Friction" as "friction", relation NotDecreasing(&["dynamic_mu", "static_mu"]) {
        /// Static coefficient, 0 for none.
        static_mu: f64 = COEFFICIENT => Number(Friction::STANDARD.static_mu);
        /// Dynamic coefficient, at most the static one.
        dynamic_mu: f64 = COEFFICIENT => Number(Friction::STANDARD.dynamic_mu);
        /// True for a layer on the surface (flour, oil, glaze), whose coefficients are those of any pair.
        coated: bool => Boolean(false);
    }
    /// A finite-element soft body of linear-elastic, isotropic material.
    SoftMaterial: "softvt.Soft" as "asset.body", constructor "softvt.soft" {
        /// Young's modulus.
        youngs_pa: f64 = PASCALS;
        /// Poisson's ratio; 0.5 would be incompressible.
        poisson: f64 = POISSON;
        /// Density of the solid part.
        density: f64 = DENSITY;
        /// Voxels along the longest edge of the bounding box.
        resolution: usize = Type::Integer(SoftMaterial::RESOLUTION) => Integer(6);
        /// Spacing of contact samples where a gripper can reach.
        grasp_spacing: f64 = Type::Number("m", SoftMaterial::GRASP_SPACING_M) => Number(0.00075);
        /// Compressive strain at which cell walls buckle and a plateau of stress begins; a
        /// calibration presses no further.
        collapse_strain: Option<f64> = STRAIN;
        /// Compressive strain that leaves a visible crack or set.
        damage_strain: Option<f64> = STRAIN;
        /// Loss factor tan δ, which is nearly constant from 1 to 10 Hz; youngs_pa is then the modulus at rest. 0 leaves
        /// the damping to the setting physics.rayleigh_stiffness.
        loss_factor: f64 = Type::Number("", ElasticMaterial::LOSS_FACTOR) => Number(0.0);
    } by |lua| ElasticMaterial::new(youngs_pa, poisson, density)
        .and_then(|elastic| elastic.with_loss_factor(loss_factor))
        .map_err(|error| fail!(lua, "{}.{error}", SoftMaterial::RECORD.label))
        .map(|elastic| SoftMaterial { elastic, resolution, grasp_spacing, collapse_strain, damage_strain });
}

record! {
    /// A free rigid body of uniform density.
    RigidSpec: "softvt.Rigid" as "asset.body", constructor "softvt.rigid" {
        /// Density of the whole volume.
        density: f64 = DENSITY;
    }
    /// A fixed body, which never moves.
    StaticSpec: "softvt.Static" as "asset.body", constructor "softvt.static" {}
    /// Scenery: it is drawn and casts shadows, but has no contact.
    ScenerySpec: "softvt.Scenery" as "asset.body", constructor "softvt.scenery" {}
    /// A kind of object. Its shape at rest has its lowest point at z = 0 and its centre on the z axis (see
    /// softvt.Shape:grounded).
    AssetSpec: "softvt.Asset" as "asset", constructor "softvt.asset", relation Checked(check_asset) {
        /// Name in results and calibration files.
        name: String = Type::Name;
        /// Shape, in metres.
        shape: LuaShape;
        /// Mechanics: soft, rigid, articulated, static or scenery.
        body: BodySpec;
        /// Friction of its surface.
        friction: Friction;
        /// Visuals by material id of the shape, from 0; by default the colours of its mesh file, or plain grey.
        visuals: Vec<Visual> => Empty;
        /// Numbers for experts (grasp height …). Those whose names end in _m are lengths, which follow an
        /// object's scale.
        hints: BTreeMap<String, f64> => Empty;
    }
}

one_of! {
    /// The mechanics of an asset.
    BodySpec {
        Soft(SoftMaterial), Rigid(RigidSpec), Articulated(ArticulatedSpec), Static(StaticSpec), Scenery(ScenerySpec),
    }
}

pub(crate) static CONSTRUCTORS: &[&Record] =
    &[AssetSpec::RECORD, SoftMaterial::RECORD, RigidSpec::RECORD, StaticSpec::RECORD, ScenerySpec::RECORD];

/// Longest side of an object that a robot handles, m. More is nearly always another unit.
const MAX_SIZE: f64 = 10.0;

fn check_asset(lua: &Lua, asset: &Table) -> Result<(), ValidationError> {
    let shape: LuaShape = LuaType::from_checked(asset.raw_get("shape")?, lua)?;
    let body: BodySpec = LuaType::from_checked(asset.raw_get("body")?, lua)?;
    let (is_handled, shape) = (matches!(body, BodySpec::Soft(_) | BodySpec::Rigid(_)), shape.copy());
    let cache = app_data::<AssetCache>(lua)?;
    let size = || cache.bounds(&shape).size();
    if is_handled && shape.loose_bounds().size().max() > MAX_SIZE && size().max() > MAX_SIZE {
        let size = size();
        let [x, y, z] = [size.x, size.y, size.z].map(|side| format_number((1e3 * side).round() / 1e3));
        let hint = "lengths are in metres (softvt.mesh takes scale = 0.001 for mm)";
        let error = mismatch!("is {x} × {y} × {z} m, expected at most {MAX_SIZE} m; {hint}");
        return Err(error.inside("shape"));
    }
    // An episode can use only files that were found when the script was loaded.
    find_calibration(lua, &asset.raw_get::<String>("name")?)
}

impl AssetSpec {
    pub(crate) fn asset(&self, lua: &Lua) -> mlua::Result<Asset> {
        let Self { friction, visuals, .. } = self;
        let shape = self.shape.copy();
        Ok(Asset {
            name: self.name.clone(),
            visuals: visuals_of(lua, &self.name, visuals, &self.shape)?,
            shape,
            body: match &self.body {
                BodySpec::Soft(soft) => Body::Soft(soft.spec.clone()),
                BodySpec::Rigid(rigid) => Body::Rigid { density: rigid.density },
                BodySpec::Articulated(parts) => {
                    Body::Articulated(joints::parts(lua, parts, visuals, *friction)?)
                }
                BodySpec::Static(_) => Body::Static,
                BodySpec::Scenery(_) => Body::Scenery,
            },
            friction: *friction,
            hints: self.hints.clone(),
        })
    }
}

functions! {
    FUNCTIONS {
        /// Returns the fingerprint of an asset: a hash of its shape, material and friction. Calibrations refer to it.
        fn fingerprint(lua, asset: Constructed<AssetSpec>) -> ["string"] { asset.asset(lua)?.fingerprint() }
        /// Returns what is most likely a mistake in an asset, as softvt check tells it.
        fn asset_warnings(lua, asset: Constructed<AssetSpec>) -> ["string[]"] {
            let body = asset.body.table();
            let mut checker = Checker::new(lua);
            for record in BodySpec::RECORDS.iter().filter(|record| is_constructed(lua, record, body)) {
                checker.record(record, body).map_err(|error| fail(lua, error.describe("body")))?;
            }
            let unusual = checker.unusual.iter().map(|found| found.describe("body"));
            unusual.chain(asset_warnings(&asset.asset(lua)?, &app_data::<AssetCache>(lua)?.approximate())).collect::<Vec<_>>()
        }
    }
}
