//! Shapes: immutable values with chained methods. All lengths are in metres.

use std::sync::Arc;

use mlua::{FromLua, Lua, Value};

use crate::{
    geometry::{
        Quat, Vec3,
        import::{ImportOptions, MeshFormat, import},
        mass::mass_properties,
        shape::{Axis, Bumps, Displacement, Ramp, Ridges, Shape, ShapeError, TreeSize},
    },
    parallel::lock,
    script::{
        schema::{LuaType, Range, Type, choice, class, functions, record},
        vm::{
            error::{app_data, current_line, fail},
            library::SharedLibrary,
            memory_budget::{Reservation, reserve},
            value::describe,
        },
    },
};

const LENGTH: Type = Type::Number("m", Range::POSITIVE);
const METRES: Type = Type::Number("m", Range::ANY);
const POINT: Type = Type::Vector(3, "m");

choice! { Axis { "x" => Axis::X, "y" => Axis::Y, "z" => Axis::Z } }

record! {
    /// A box centred on the origin.
    BoxSpec: "softvt.BoxSpec" as "shape.box" {
        /// Edge lengths.
        size: [f64; 3] = POINT;
    }
    /// A sphere centred on the origin.
    SphereSpec: "softvt.SphereSpec" as "shape.sphere" {
        /// Radius.
        radius: f64 = LENGTH;
    }
    /// An ellipsoid centred on the origin.
    EllipsoidSpec: "softvt.EllipsoidSpec" as "shape.ellipsoid" {
        /// Diameters along x, y and z.
        size: [f64; 3] = POINT;
    }
    /// A capsule along the z axis, centred on the origin.
    CapsuleSpec: "softvt.CapsuleSpec" as "shape.capsule" {
        /// Radius.
        radius: f64 = LENGTH;
        /// Total length including the caps; at least twice the radius.
        length: f64 = LENGTH;
    }
    /// A cylinder along the z axis, centred on the origin.
    CylinderSpec: "softvt.CylinderSpec" as "shape.cylinder" {
        /// Radius.
        radius: f64 = LENGTH;
        /// Height.
        height: f64 = LENGTH;
    }
    /// A torus about the z axis, centred on the origin.
    TorusSpec: "softvt.TorusSpec" as "shape.torus" {
        /// Radius of the centre line of the tube.
        major: f64 = LENGTH;
        /// Radius of the tube, less than major.
        minor: f64 = LENGTH;
    }
    /// A triangular prism along y in a box centred on the origin.
    WedgeSpec: "softvt.WedgeSpec" as "shape.wedge" {
        /// Edge lengths of the box.
        size: [f64; 3] = POINT;
        /// Position of the top edge across the width: -1 and 1 are the sides, 0 the middle.
        apex: f64 = Type::Number("", Range::closed(-1.0, 1.0)) => Number(0.0);
    }
    /// A polygon in (x, z), extruded along y and centred on y = 0.
    PrismSpec: "softvt.PrismSpec" as "shape.prism" {
        /// Corners (x, z) in order.
        corners: Vec<[f64; 2]> = Type::List(&Type::Vector(2, "m"));
        /// Length along y.
        length: f64 = LENGTH;
    }
    /// A profile revolved about the z axis.
    LatheSpec: "softvt.LatheSpec" as "shape.lathe" {
        /// Corners (r, z) in order, with r ≥ 0.
        corners: Vec<[f64; 2]> = Type::List(&Type::Vector(2, "m"));
    }
    /// A rotation about an axis through the origin.
    RotateSpec: "softvt.RotateSpec" as "shape:rotate" {
        /// The axis.
        axis: Axis;
        /// Right-handed angle.
        angle: f64 = Type::Number("rad", Range::ANY);
    }
    /// A twist about an axis through the origin.
    TwistSpec: "softvt.TwistSpec" as "shape:twist" {
        /// The axis.
        axis: Axis;
        /// Angle per length along the axis.
        rate: f64 = Type::Number("rad/m", Range::ANY);
    }
    /// A bend into an arc; the origin stays in place.
    BendSpec: "softvt.BendSpec" as "shape:bend" {
        /// The axis that becomes an arc.
        along: Axis;
        /// The axis with the centre of the arc.
        towards: Axis;
        /// Curvature of the arc.
        curvature: f64 = Type::Number("1/m", Range::ANY);
    }
    /// A weight that rises smoothly from 0 to 1 along an axis.
    MaskSpec: "softvt.MaskSpec" as "mask" {
        /// The axis.
        axis: Axis;
        /// Coordinate at which the weight is 0.
        from: f64 = METRES;
        /// Coordinate at which the weight is 1.
        to: f64 = METRES;
    }
    /// Adds regular ridges to a shape: rings, flutes, screws or spirals.
    RidgesSpec: "softvt.RidgesSpec" as "shape:ridges" {
        /// The axis that the ridges run around or along.
        axis: Axis => Text("z");
        /// Height from valley to crest; negative for grooves.
        height: f64 = METRES;
        /// Number of ridges around the axis.
        count: i32 = Type::Integer(Range::closed(-1000.0, 1000.0)) => Integer(0);
        /// Distance of ridges along the axis.
        pitch: Option<f64> = LENGTH;
        /// Distance of ridges away from the axis.
        radial_pitch: Option<f64> = LENGTH;
        /// Phase.
        phase: f64 = Type::Number("rad", Range::ANY) => Number(0.0);
        /// 1 is a sine; larger values give narrower ridges.
        sharpness: f64 = Type::Number("", Range::closed(1.0, 8.0)) => Number(1.0);
        /// Weight of their height; 1 everywhere by default.
        mask: Option<MaskSpec>;
    }
    /// Adds scattered bumps to a shape (seeds, raisins).
    BumpsSpec: "softvt.BumpsSpec" as "shape:bumps" {
        /// Height; negative for pits.
        height: f64 = METRES;
        /// Radius of a bump, at most half the spacing.
        radius: f64 = LENGTH;
        /// Mean distance of bumps.
        spacing: f64 = LENGTH;
        /// Selects their positions.
        seed: u64 = Type::Integer(Range::NOT_NEGATIVE) => Integer(0);
        /// Weight of their height; 1 everywhere by default.
        mask: Option<MaskSpec>;
    }
    /// Gives all or part of the surface another material.
    PaintSpec: "softvt.PaintSpec" as "shape:paint" {
        /// Material id: index into the asset's visuals, from 0.
        material: u16 = Type::Integer(Range::closed(0.0, 65535.0));
        /// Part of the surface inside of this shape; the whole surface by default.
        region: Option<LuaShape>;
    }
    /// A closed surface from an OBJ, STL or GLB file.
    MeshSpec: "softvt.MeshSpec" as "mesh" {
        /// Path inside of the project, next to the Lua file or from a root folder.
        file: String;
        /// Metres per unit of the file: 0.001 for millimetres.
        scale: f64 = LENGTH => Number(1.0);
        /// True if z is up in the file; otherwise y is.
        z_up: bool => Boolean(true);
    }
}

impl MaskSpec {
    fn ramp(&self) -> Ramp {
        Ramp { axis: self.axis, from: self.from, to: self.to }
    }
}

/// Largest tree of a shape: every evaluation of its distance visits all of it.
const MAX_TREE: TreeSize = TreeSize { nodes: 2000, depth: 100, work: 1e5 };

/// `softvt.Shape`.
#[derive(Clone, Debug)]
pub(crate) struct LuaShape(Arc<Node>);

#[derive(Debug)]
struct Node {
    shape: Shape,
    /// Memory it keeps, bytes; parts shared with other shapes count for each of them.
    bytes: usize,
    _reserved: Reservation,
}

impl LuaShape {
    pub(crate) fn shape(&self) -> &Shape {
        &self.0.shape
    }

    /// Memory it keeps, bytes.
    pub(crate) fn bytes(&self) -> usize {
        self.0.bytes
    }

    /// Checks a shape that keeps `extra_bytes` in addition to its tree.
    fn new(lua: &Lua, shape: Shape, extra_bytes: usize) -> mlua::Result<Self> {
        let TreeSize { nodes, depth, work } = shape.tree_size();
        if work > MAX_TREE.work {
            let message = "shape: cuts or unions are nested too deeply to be evaluated; join the parts by union first \
                           (a:union(b):union(c)), then cut or join them at once";
            return Err(fail(lua, message));
        }
        if nodes > MAX_TREE.nodes || depth > MAX_TREE.depth {
            return Err(fail(
                lua,
                format!(
                    "shape: is made of {nodes} shapes, {depth} deep; at most {} and {} can be evaluated; use fewer, or a mesh",
                    MAX_TREE.nodes, MAX_TREE.depth
                ),
            ));
        }
        shape.validate().map_err(|error| fail(lua, format!("shape.{error}")))?;
        let bytes = nodes * size_of::<Shape>() + extra_bytes;
        Ok(Self(Arc::new(Node { shape, bytes, _reserved: reserve(lua, bytes)? })))
    }

    /// A copy of its tree.
    pub(crate) fn copy(&self) -> Shape {
        self.0.shape.clone()
    }

    /// A shape made of this one and `others`.
    fn derived(&self, lua: &Lua, shape: Shape, others: &[&Self]) -> mlua::Result<Self> {
        let own = |shape: &Self| shape.0.bytes - shape.0.shape.tree_size().nodes * size_of::<Shape>();
        let extra_bytes = others.iter().map(|other| own(other)).sum::<usize>() + own(self);
        Self::new(lua, shape, extra_bytes)
    }
}

impl FromLua for LuaShape {
    fn from_lua(value: Value, lua: &Lua) -> mlua::Result<Self> {
        match value.as_userdata().and_then(|data| data.borrow::<Self>().ok()) {
            Some(shape) => Ok(shape.clone()),
            None => {
                Err(fail(lua, format!("expected a shape (softvt.shape.…{{…}}), got {}", describe(&value))))
            }
        }
    }
}

impl LuaType for LuaShape {
    const TYPE: Type = Type::Object("softvt.Shape");
}

/// Memory of a profile's corner with its edge.
const BYTES_PER_CORNER: usize = 128;
/// Memory of a mesh shape, in bytes per byte of its file.
const MESH_BYTES_PER_FILE_BYTE: usize = 8;

/// Makes a shape with `corners` of a profile.
fn build(lua: &Lua, shape: Result<Shape, ShapeError>, corners: usize) -> mlua::Result<LuaShape> {
    let shape = shape.map_err(|error| fail(lua, format!("shape.{error}")))?;
    LuaShape::new(lua, shape, corners * BYTES_PER_CORNER)
}

functions! {
    SHAPES {
        fn box(lua, spec: BoxSpec) -> ["softvt.Shape"] {
            build(lua, Ok(Shape::cuboid(spec.size.into())), 0)?
        }
        fn sphere(lua, spec: SphereSpec) -> ["softvt.Shape"] {
            build(lua, Ok(Shape::Sphere { radius: spec.radius }), 0)?
        }
        fn ellipsoid(lua, spec: EllipsoidSpec) -> ["softvt.Shape"] {
            build(lua, Ok(Shape::Ellipsoid { radii: 0.5 * Vec3::from(spec.size) }), 0)?
        }
        fn capsule(lua, spec: CapsuleSpec) -> ["softvt.Shape"] {
            let half_length = 0.5 * spec.length - spec.radius;
            build(lua, Ok(Shape::Capsule { radius: spec.radius, half_length }), 0)?
        }
        fn cylinder(lua, spec: CylinderSpec) -> ["softvt.Shape"] {
            build(lua, Ok(Shape::Cylinder { radius: spec.radius, half_height: 0.5 * spec.height }), 0)?
        }
        fn torus(lua, spec: TorusSpec) -> ["softvt.Shape"] {
            build(lua, Ok(Shape::Torus { major: spec.major, minor: spec.minor }), 0)?
        }
        fn wedge(lua, spec: WedgeSpec) -> ["softvt.Shape"] {
            build(lua, Shape::wedge(spec.size.into(), spec.apex), 0)?
        }
        fn prism(lua, spec: PrismSpec) -> ["softvt.Shape"] {
            let corners = spec.corners.len();
            build(lua, Shape::prism(spec.corners, spec.length), corners)?
        }
        fn lathe(lua, spec: LatheSpec) -> ["softvt.Shape"] {
            let corners = spec.corners.len();
            build(lua, Shape::lathe(spec.corners), corners)?
        }
    }
}

functions! {
    FUNCTIONS {
        /// Reads a shape from a mesh file: `softvt.mesh { file = "mug.obj", scale = 0.001 }`. The surface must be closed.
        fn mesh(lua, spec: MeshSpec) -> ["softvt.Shape"] {
            let path = &spec.file;
            let requester = current_line(lua).map(|line| line.file);
            let library = app_data::<SharedLibrary>(lua)?;
            let file = lock(&library).data(path, requester.as_deref());
            let bytes = file.map_err(|error| fail(lua, format!("mesh.file: {error}")))?.bytes;
            // Fails before the mesh is built if it would not fit.
            drop(reserve(lua, MESH_BYTES_PER_FILE_BYTE * bytes.len())?);
            let extension = path.rsplit_once('.').map_or("", |(_, extension)| extension);
            let options = ImportOptions { scale: spec.scale, z_up: spec.z_up };
            let shape = MeshFormat::from_extension(extension)
                .and_then(|format| import(&bytes, format, &options))
                .and_then(|mesh| Ok(Shape::from_mesh(mesh)?));
            let shape = shape.map_err(|error| fail(lua, format!("mesh: {path}: {error}")))?;
            LuaShape::new(lua, shape, MESH_BYTES_PER_FILE_BYTE * bytes.len())?
        }
    }
}

class! {
    /// A solid. Methods return a new shape and leave this one as it is.
    LuaShape: "softvt.Shape" {
        label(_) { "shape".to_owned() }
        methods {
            /// Moves the shape by an offset, m.
            fn translate(lua, this, x: f64 = METRES, y: f64 = METRES, z: f64 = METRES) -> ["softvt.Shape"] {
                this.derived(lua, this.copy().translated(Vec3::new(x, y, z)), &[])?
            }
            /// Stretches the shape by factors along x, y and z; a single factor holds for all axes.
            fn scale(lua, this, x: f64, y: Option<f64>, z: Option<f64>) -> ["softvt.Shape"] {
                let factors = Vec3::new(x, y.unwrap_or(x), z.unwrap_or(x));
                this.derived(lua, this.copy().scaled(factors), &[])?
            }
            /// Grows the shape by a radius (m), which rounds convex edges.
            fn round(lua, this, radius: f64 = METRES) -> ["softvt.Shape"] {
                this.derived(lua, this.copy().rounded(radius), &[])?
            }
            /// Keeps the wall of this thickness (m) below the surface.
            fn shell(lua, this, wall: f64 = METRES) -> ["softvt.Shape"] {
                this.derived(lua, this.copy().shell(wall), &[])?
            }
            /// Joins two shapes.
            fn union(lua, this, other: LuaShape) -> ["softvt.Shape"] {
                this.derived(lua, this.copy().union(other.copy()), &[&other])?
            }
            /// Keeps the part that lies in both shapes.
            fn intersect(lua, this, other: LuaShape) -> ["softvt.Shape"] {
                this.derived(lua, this.copy().intersect(other.copy()), &[&other])?
            }
            /// Cuts another shape out of this one; blend (m) rounds the edge.
            fn subtract(lua, this, cut: LuaShape, blend: Option<f64> = METRES) -> ["softvt.Shape"] {
                let shape = match blend {
                    None => this.copy().subtract(cut.copy()),
                    Some(blend) => this.copy().smooth_subtract(cut.copy(), blend),
                };
                this.derived(lua, shape, &[&cut])?
            }
            /// Joins two shapes with a fillet of width blend (m).
            fn smooth_union(lua, this, other: LuaShape, blend: f64 = METRES) -> ["softvt.Shape"] {
                this.derived(lua, this.copy().smooth_union(other.copy(), blend), &[&other])?
            }
            /// Returns the lowest and the highest corner of the bounding box, m.
            fn bounds(lua, this) -> ["number[]", "number[]"] {
                let bounds = this.shape().bounds();
                let list = |corner: Vec3| lua.create_sequence_from([corner.x, corner.y, corner.z]);
                (list(bounds.min)?, list(bounds.max)?)
            }
            /// Returns the volume, m³.
            fn volume(_, this) -> ["number"] { mass_properties(this.shape(), 1.0).mass }
            /// Moves the shape so that its lowest point is at z = 0 and its centre on the z axis, as assets require.
            fn grounded(lua, this) -> ["softvt.Shape"] {
                let bounds = this.shape().bounds();
                let centre = bounds.centre();
                let offset = Vec3::new(-centre.x, -centre.y, -bounds.min.z);
                this.derived(lua, this.copy().translated(offset), &[])?
            }
            fn rotate(lua, this, spec: RotateSpec) -> ["softvt.Shape"] {
                let axis = nalgebra::Unit::new_unchecked(spec.axis.unit());
                this.derived(lua, this.copy().rotated(Quat::from_axis_angle(&axis, spec.angle)), &[])?
            }
            fn twist(lua, this, spec: TwistSpec) -> ["softvt.Shape"] {
                this.derived(lua, this.copy().twisted(spec.axis, spec.rate), &[])?
            }
            fn bend(lua, this, spec: BendSpec) -> ["softvt.Shape"] {
                this.derived(lua, this.copy().bent(spec.along, spec.towards, spec.curvature), &[])?
            }
            fn ridges(lua, this, spec: RidgesSpec) -> ["softvt.Shape"] {
                let ridges = Displacement::Ridges(Ridges {
                    axis: spec.axis,
                    height: spec.height,
                    count: spec.count,
                    pitch: spec.pitch.unwrap_or(f64::INFINITY),
                    radial_pitch: spec.radial_pitch.unwrap_or(f64::INFINITY),
                    phase: spec.phase,
                    sharpness: spec.sharpness,
                    mask: spec.mask.as_ref().map(MaskSpec::ramp),
                });
                this.derived(lua, this.copy().displaced(ridges), &[])?
            }
            fn bumps(lua, this, spec: BumpsSpec) -> ["softvt.Shape"] {
                let bumps = Displacement::Bumps(Bumps {
                    height: spec.height,
                    radius: spec.radius,
                    spacing: spec.spacing,
                    seed: spec.seed,
                    mask: spec.mask.as_ref().map(MaskSpec::ramp),
                });
                this.derived(lua, this.copy().displaced(bumps), &[])?
            }
            fn paint(lua, this, spec: PaintSpec) -> ["softvt.Shape"] {
                let region = spec.region.as_ref();
                let shape = this.copy().painted(spec.material, region.map(LuaShape::copy));
                this.derived(lua, shape, &Vec::from_iter(region))?
            }
        }
    }
}
