//! Shapes: immutable values with chained methods. All lengths are in metres.

use std::{
    collections::BTreeSet,
    f64::consts::TAU,
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, Ordering},
    },
};

use mlua::Lua;

use super::{
    mesh_colours::{FileColours, path_beside},
    pose::ANGLES,
};
use crate::{
    schema::{Range, Type, choice, class, functions, record_of},
    vm::{
        error::{SourceLine, app_data, author_line, current_line},
        library::{LibraryError, SharedLibrary},
        memory_budget::{Reservation, reserve},
    },
};
use softvt_common::parallel::lock;
use softvt_geometry::{
    Aabb, Quat, Vec3,
    import::{MeshFormat, MeshImportError, MeshImportOptions, import, import_colours},
    mass::mass_properties,
    shape::{Axis, Bumps, Ramp, Ridges, Shape, ShapeError, ShapeTreeSize, SurfaceRelief},
};
use softvt_rollout::AssetCache;
use softvt_scene::Visual;

const LENGTH: Type = Type::Number("m", Range::POSITIVE.usually(1e-6, 20.0));
const METRES: Type = Type::Number("m", Range::ANY.usually(-5.0, 5.0));
const RELIEF: Type = Type::Number("m", Range::ANY.usually(-0.1, 0.1));
const POINT: Type = Type::vector(3, "m");
const CORNERS: Type = Type::List(&Type::vector(2, "m"));

choice! { Axis { "x" => X, "y" => Y, "z" => Z } }

record_of! {
    /// A weight that rises smoothly from 0 to 1 along an axis.
    Ramp: "softvt.Ramp" as "mask" {
        /// Axis of the coordinate.
        axis: Axis;
        /// Coordinate at which the weight is 0.
        from: f64 = METRES;
        /// Coordinate at which the weight is 1.
        to: f64 = METRES;
    }
}

/// Largest number of nodes, depth and work of the tree of a shape: every evaluation of its distance visits all of it.
const MAX_NODES: usize = 2000;
const MAX_DEPTH: usize = 100;
const MAX_WORK: f64 = 1e5;

#[derive(Clone, Debug)]
pub(crate) struct LuaShape(Arc<Node>);

#[derive(Debug)]
struct Node {
    shape: Shape,
    /// Colours of the mesh files in it, or why they cannot be read.
    colours: Result<Vec<Arc<FileColours>>, String>,
    use_mark: UseMark,
    _reserved: Reservation,
}

/// Lines of a script that made a shape which nothing read before it was dropped, such as the result of a method
/// that was not kept.
#[derive(Clone, Debug, Default)]
pub(crate) struct UnusedShapes(Arc<Mutex<BTreeSet<SourceLine>>>);

impl UnusedShapes {
    /// The lines so far, each as `file:line`.
    pub(crate) fn lines(lua: &Lua) -> mlua::Result<Vec<String>> {
        lua.gc_collect()?;
        let unused = app_data::<Self>(lua)?;
        Ok(lock(&unused.0).iter().map(ToString::to_string).collect())
    }
}

/// A note that a shape was read; without it the shape is reported as unused on drop.
#[derive(Debug)]
struct UseMark {
    is_used: AtomicBool,
    made_at: Option<SourceLine>,
    unused: UnusedShapes,
}

impl UseMark {
    fn new(lua: &Lua) -> mlua::Result<Self> {
        Ok(Self { is_used: AtomicBool::new(false), made_at: author_line(lua), unused: app_data(lua)? })
    }

    fn set(&self) {
        self.is_used.store(true, Ordering::Relaxed);
    }
}

impl Drop for UseMark {
    fn drop(&mut self) {
        if !*self.is_used.get_mut() {
            lock(&self.unused.0).extend(self.made_at.take());
        }
    }
}

impl LuaShape {
    pub(crate) fn made_at(&self) -> Option<&SourceLine> {
        self.0.use_mark.made_at.as_ref()
    }

    /// The visual that its mesh files state; `None` without one.
    pub(crate) fn file_visual(&self) -> Result<Option<Visual>, String> {
        self.0.colours.clone().map(|colours| FileColours::visual(&colours, self.shape()))
    }

    pub(crate) fn shape(&self) -> &Shape {
        self.0.use_mark.set();
        &self.0.shape
    }

    /// Memory of its tree, bytes.
    pub(crate) fn bytes(&self) -> usize {
        self.0.shape.tree_size().bytes
    }

    /// Checks a shape. Memory that it shares with others counts for each of them.
    fn new(lua: &Lua, shape: Shape, colours: Result<Vec<Arc<FileColours>>, String>) -> mlua::Result<Self> {
        let ShapeTreeSize { nodes, bytes, depth, work } = shape.tree_size();
        if work > MAX_WORK {
            bail!(
                lua,
                "shape: cuts or unions are nested too deeply; join the parts by union first, then cut"
            );
        }
        if nodes > MAX_NODES || depth > MAX_DEPTH {
            bail!(
                lua,
                "shape: is {nodes} shapes, {depth} deep, expected at most {MAX_NODES} and {MAX_DEPTH}"
            );
        }
        shape.validate().map_err(|error| fail!(lua, "shape.{error}"))?;
        let bytes = bytes + colours.iter().flatten().map(|colours| colours.bytes).sum::<usize>();
        let use_mark = UseMark::new(lua)?;
        Ok(Self(Arc::new(Node { shape, colours, use_mark, _reserved: reserve(lua, bytes)? })))
    }

    fn bounds(&self, lua: &Lua) -> mlua::Result<Aabb> {
        Ok(app_data::<AssetCache>(lua)?.bounds(self.shape()))
    }

    pub(crate) fn copy(&self) -> Shape {
        self.shape().clone()
    }

    /// Checks that a wall leaves something of the inside free.
    fn check_shell(&self, lua: &Lua, wall: f64) -> mlua::Result<()> {
        if self.shape().loose_bounds().size().min() > 2.0 * wall {
            return Ok(());
        }
        Err(fail!(lua, "shape:shell: a wall of {wall} m fills the shape; lengths are in metres"))
    }

    /// Refuses an operation with another shape that is more than `reach` (m) away, and so changes nothing.
    fn refuse_apart(&self, lua: &Lua, method: &str, other: &Self, reach: f64) -> mlua::Result<()> {
        if self.shape().loose_bounds().loosened(reach).intersects(&other.shape().loose_bounds()) {
            return Ok(());
        }
        let message =
            "the other shape lies outside of this one, so that nothing changes; lengths are in metres";
        Err(fail!(lua, "shape:{method}: {message}"))
    }

    /// Checks that a bent shape does not reach the centre of its arc, or its own other end.
    fn check_bend(&self, lua: &Lua, along: Axis, towards: Axis, curvature: f64) -> mlua::Result<()> {
        const ROUNDING: f64 = 1e-6;
        let overlaps = |bounds: Aabb| {
            let (i, k) = (along.index(), towards.index());
            let reach = (bounds.min[k] * curvature).max(bounds.max[k] * curvature);
            reach > 1.0 + ROUNDING || bounds.size()[i] * curvature.abs() > TAU * (1.0 + ROUNDING)
        };
        if !overlaps(self.shape().loose_bounds()) || !overlaps(self.bounds(lua)?) {
            return Ok(());
        }
        Err(fail!(lua, "shape:bend: with a curvature of {curvature} per m the shape overlaps itself"))
    }

    fn derived(&self, lua: &Lua, shape: Shape, others: &[&Self]) -> mlua::Result<Self> {
        let parts = std::iter::once(self).chain(others.iter().copied());
        let colours = parts.map(|part| part.0.colours.clone()).collect::<Result<Vec<_>, String>>();
        Self::new(lua, shape, colours.map(|all| all.concat()))
    }
}

/// Makes a shape that is not made of others.
fn build(lua: &Lua, shape: Result<Shape, ShapeError>) -> mlua::Result<LuaShape> {
    let shape = shape.map_err(|error| fail!(lua, "shape.{error}"))?;
    LuaShape::new(lua, shape, Ok(Vec::new()))
}

functions! {
    SHAPES {
        /// A box centred on the origin.
        fn box(lua) takes spec "softvt.BoxSpec" {
            /// Edge lengths along x, y and z.
            size: [f64; 3] = POINT;
        } -> ["softvt.Shape"] { build(lua, Ok(Shape::cuboid(size.into())))? }
        /// A sphere centred on the origin.
        fn sphere(lua) takes spec "softvt.SphereSpec" {
            /// Radius of the sphere.
            radius: f64 = LENGTH;
        } -> ["softvt.Shape"] { build(lua, Ok(Shape::Sphere { radius }))? }
        /// An ellipsoid centred on the origin.
        fn ellipsoid(lua) takes spec "softvt.EllipsoidSpec" {
            /// Diameters along x, y and z.
            size: [f64; 3] = POINT;
        } -> ["softvt.Shape"] { build(lua, Ok(Shape::Ellipsoid { radii: 0.5 * Vec3::from(size) }))? }
        /// A capsule along the z axis, centred on the origin.
        fn capsule(lua) takes spec "softvt.CapsuleSpec" {
            /// Radius of the tube and its caps.
            radius: f64 = LENGTH;
            /// Total length including the caps; at least twice the radius.
            length: f64 = LENGTH;
        } -> ["softvt.Shape"] {
            build(lua, Ok(Shape::Capsule { radius, half_length: 0.5 * length - radius }))?
        }
        /// A cylinder along the z axis, centred on the origin.
        fn cylinder(lua) takes spec "softvt.CylinderSpec" {
            /// Radius of the cylinder.
            radius: f64 = LENGTH;
            /// Height of the cylinder.
            height: f64 = LENGTH;
        } -> ["softvt.Shape"] { build(lua, Ok(Shape::Cylinder { radius, half_height: 0.5 * height }))? }
        /// A torus about the z axis, centred on the origin.
        fn torus(lua) takes spec "softvt.TorusSpec" {
            /// Radius of the centre line of the tube.
            major: f64 = LENGTH;
            /// Radius of the tube, less than major.
            minor: f64 = LENGTH;
        } -> ["softvt.Shape"] { build(lua, Ok(Shape::Torus { major, minor }))? }
        /// A triangular prism along y in a box centred on the origin.
        fn wedge(lua) takes spec "softvt.WedgeSpec" {
            /// Edge lengths of the box.
            size: [f64; 3] = POINT;
            /// Position of the top edge across the width: -1 and 1 are the sides, 0 the middle.
            apex: f64 = Type::Number("", Range::closed(-1.0, 1.0)) => Number(0.0);
        } -> ["softvt.Shape"] { build(lua, Shape::wedge(size.into(), apex))? }
        /// A polygon in (x, z), extruded along y and centred on y = 0.
        fn prism(lua) takes spec "softvt.PrismSpec" {
            /// Corners (x, z) in order.
            corners: Vec<[f64; 2]> = CORNERS;
            /// Length of the prism along y.
            length: f64 = LENGTH;
        } -> ["softvt.Shape"] { build(lua, Shape::prism(corners, length))? }
        /// A profile revolved about the z axis.
        fn lathe(lua) takes spec "softvt.LatheSpec" {
            /// Corners (r, z) in order, with r ≥ 0.
            corners: Vec<[f64; 2]> = CORNERS;
        } -> ["softvt.Shape"] { build(lua, Shape::lathe(corners))? }
    }
}

functions! {
    FUNCTIONS {
        /// Reads a shape from an OBJ, STL or GLB file: `softvt.mesh { file = "mug.obj", scale = 0.001 }`. The surface
        /// must be closed. An asset without visuals has the colours and images of the materials in the file: Kd and
        /// map_Kd of the MTL files that an OBJ file names, or the base colours of a GLB file; images are PNG or JPEG.
        /// All objects of the file are one shape; of a GLB file those of its default scene. Vertices within 1e-6 of the
        /// diagonal are one where the surface is open without that.
        fn mesh(lua) takes spec "softvt.MeshSpec" {
            /// Path inside of the project, next to the Lua file or from a root folder.
            file: String;
            /// Metres per unit of the file: 0.001 for millimetres.
            scale: f64 = LENGTH => Number(1.0);
            /// True if z is up in the file, false if y is. By default y in a GLB file, as glTF says, and z in others.
            z_up: Option<bool>;
        } -> ["softvt.Shape"] {
            let requester = current_line(lua).map(|line| line.file);
            let library = app_data::<SharedLibrary>(lua)?;
            let found = lock(&library).data(&file, requester.as_deref());
            let bytes = found.map_err(|error| fail!(lua, "softvt.mesh.file: {error}"))?.bytes;
            let extension = file.rsplit_once('.').map_or("", |(_, extension)| extension);
            let refused = |error: MeshImportError| fail!(lua, "softvt.mesh: {file}: {error}");
            let mesh = MeshFormat::from_extension(extension)
                .and_then(|format| import(&bytes, format, &MeshImportOptions { scale, z_up }))
                .map_err(refused)?;
            let shape = Shape::from_mesh(mesh).map_err(|error| refused(error.into()))?;
            let beside = |name: &str| {
                let found = lock(&library).data(&path_beside(&file, name)?, requester.as_deref());
                found.map(|found| found.bytes.to_vec()).map_err(|error| match error {
                    missing @ LibraryError::Missing(_) => format!("{missing}; add it"),
                    other => other.to_string(),
                })
            };
            let colours = match &shape {
                Shape::Mesh(solid) => MeshFormat::from_extension(extension)
                    .map_err(|error| error.to_string())
                    .and_then(|format| import_colours(&bytes, format, &beside))
                    .and_then(|colours| FileColours::new(colours, solid, &beside))
                    .map(|colours| colours.map(Arc::new).into_iter().collect())
                    .map_err(|error| format!("{file}: {error}")),
                _ => Ok(Vec::new()),
            };
            LuaShape::new(lua, shape, colours)?
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
            /// Stretches the shape by factors along x, y and z, or by a single factor along all axes.
            fn scale(lua, this, x: f64, y: Option<f64>, z: Option<f64>) -> ["softvt.Shape"] {
                let factors = match (y, z) {
                    (None, None) => Vec3::repeat(x),
                    (Some(y), Some(z)) => Vec3::new(x, y, z),
                    _ => return Err(fail!(lua, "shape:scale: expected one factor or three, got two")),
                };
                this.derived(lua, this.copy().scaled(factors), &[])?
            }
            /// Grows the shape by a radius (m), which rounds convex edges.
            fn round(lua, this, radius: f64 = METRES) -> ["softvt.Shape"] {
                this.derived(lua, this.copy().rounded(radius), &[])?
            }
            /// Keeps the wall of this thickness (m) below the surface.
            fn shell(lua, this, wall: f64 = METRES) -> ["softvt.Shape"] {
                this.check_shell(lua, wall)?;
                this.derived(lua, this.copy().shell(wall), &[])?
            }
            /// Joins the shape and another one.
            fn union(lua, this, other: LuaShape) -> ["softvt.Shape"] {
                this.derived(lua, this.copy().union(other.copy()), &[&other])?
            }
            /// Keeps the part that lies in both shapes.
            fn intersect(lua, this, other: LuaShape) -> ["softvt.Shape"] {
                this.derived(lua, this.copy().intersect(other.copy()), &[&other])?
            }
            /// Cuts another shape out of this one; blend (m) rounds the edge.
            fn subtract(lua, this, cut: LuaShape, blend: Option<f64> = METRES) -> ["softvt.Shape"] {
                this.refuse_apart(lua, "subtract", &cut, blend.unwrap_or(0.0))?;
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
                let bounds = this.bounds(lua)?;
                let list = |corner: Vec3| lua.create_sequence_from([corner.x, corner.y, corner.z]);
                (list(bounds.min)?, list(bounds.max)?)
            }
            /// Returns the volume, m³.
            fn volume(_, this) -> ["number"] { mass_properties(this.shape(), 1.0).mass }
            /// Moves the shape so that its lowest point is at z = 0 and its centre on the z axis, as assets require.
            fn grounded(lua, this) -> ["softvt.Shape"] {
                let bounds = this.bounds(lua)?;
                let centre = bounds.centre();
                let offset = Vec3::new(-centre.x, -centre.y, -bounds.min.z);
                this.derived(lua, this.copy().translated(offset), &[])?
            }
            /// Rotates the shape about an axis through the origin.
            fn rotate(lua, this) takes spec "softvt.RotateSpec" {
                /// Axis of the rotation.
                axis: Axis;
                /// Right-handed angle.
                angle: f64 = Type::Number("rad", ANGLES);
            } -> ["softvt.Shape"] {
                let axis = nalgebra::Unit::new_unchecked(axis.unit());
                this.derived(lua, this.copy().rotated(Quat::from_axis_angle(&axis, angle)), &[])?
            }
            /// Twists the shape about an axis through the origin.
            fn twist(lua, this) takes spec "softvt.TwistSpec" {
                /// Axis of the twist.
                axis: Axis;
                /// Angle per length along the axis.
                rate: f64 = Type::Number("rad/m", Range::ANY);
            } -> ["softvt.Shape"] { this.derived(lua, this.copy().twisted(axis, rate), &[])? }
            /// Bends the shape into an arc; the origin stays in place.
            fn bend(lua, this) takes spec "softvt.BendSpec" {
                /// The axis that becomes an arc.
                along: Axis;
                /// The axis with the centre of the arc.
                towards: Axis;
                /// Curvature of the arc.
                curvature: f64 = Type::Number("1/m", Range::ANY);
            } -> ["softvt.Shape"] {
                this.check_bend(lua, along, towards, curvature)?;
                this.derived(lua, this.copy().bent(along, towards, curvature), &[])?
            }
            /// Adds regular ridges to a shape: rings, flutes, screws or spirals.
            fn ridges(lua, this) takes spec "softvt.RidgesSpec" {
                /// The axis that the ridges run around or along.
                axis: Axis => Text("z");
                /// Height from valley to crest; negative for grooves.
                height: f64 = RELIEF;
                /// Number of ridges around the axis.
                count: i32 = Type::Integer(Range::closed(-1000.0, 1000.0)) => Integer(0);
                /// Distance of ridges along the axis; infinite for flutes.
                pitch: f64 = LENGTH => Number(f64::INFINITY);
                /// Distance of ridges away from the axis; infinite if they do not depend on it.
                radial_pitch: f64 = LENGTH => Number(f64::INFINITY);
                /// Phase of the ridges at the origin.
                phase: f64 = Type::Number("rad", Range::ANY) => Number(0.0);
                /// 1 is a sine; larger values give narrower ridges.
                sharpness: f64 = Type::Number("", Range::closed(1.0, 8.0)) => Number(1.0);
                /// Weight of their height; 1 everywhere by default.
                mask: Option<Ramp>;
            } -> ["softvt.Shape"] {
                if count == 0 && pitch.is_infinite() && radial_pitch.is_infinite() {
                    bail!(lua, "shape:ridges: without a count, pitch or radial_pitch it adds nothing; give one");
                }
                let ridges = Ridges { axis, height, count, pitch, radial_pitch, phase, sharpness, mask };
                this.derived(lua, this.copy().displaced(SurfaceRelief::Ridges(ridges)), &[])?
            }
            /// Adds scattered bumps to a shape (seeds, raisins).
            fn bumps(lua, this) takes spec "softvt.BumpsSpec" {
                /// Height; negative for pits.
                height: f64 = RELIEF;
                /// Radius of a bump, at most half the spacing.
                radius: f64 = LENGTH;
                /// Mean distance of bumps.
                spacing: f64 = LENGTH;
                /// Seed of the positions of the bumps.
                seed: u64 => Integer(0);
                /// Weight of their height; 1 everywhere by default.
                mask: Option<Ramp>;
            } -> ["softvt.Shape"] {
                let bumps = Bumps { height, radius, spacing, seed, mask };
                this.derived(lua, this.copy().displaced(SurfaceRelief::Bumps(bumps)), &[])?
            }
            /// Gives all or part of the surface another material.
            fn paint(lua, this) takes spec "softvt.PaintSpec" {
                /// Material id: index into the asset's visuals, from 0.
                material: u16;
                /// Part of the surface inside of this shape; the whole surface by default.
                region: Option<LuaShape>;
            } -> ["softvt.Shape"] {
                if let Some(region) = &region {
                    this.refuse_apart(lua, "paint", region, 0.0)?;
                }
                let shape = this.copy().painted(material, region.as_ref().map(LuaShape::copy));
                this.derived(lua, shape, &Vec::from_iter(&region))?
            }
        }
    }
}
