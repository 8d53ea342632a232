//! Parameters of the mechanics.

use softvt_common::range::Range;
use softvt_geometry::Vec3;

/// Gravity of every scene that states no other, m/s².
pub const STANDARD_GRAVITY: Vec3 = Vec3::new(0.0, 0.0, -9.81);

softvt_common::settings! {
    /// Parameters of the mechanics. The defaults are those of the benchmark.
    ///
    /// [`check`](softvt_common::settings::SettingField::check) rejects values outside of the valid ranges; a
    /// [`World`](super::World) assumes valid ones.
    pub struct PhysicsParams {
        /// Time step. Control runs at 20 Hz independently of it, so it must divide 0.05 s in the benchmark. Limits and
        /// grip windows are calibrated with the default.
        dt: f64 = 1.0 / 60.0, "s", Range::closed(1e-4, 0.05);
        /// Factor on the number of voxels along each edge of soft bodies, which shows how a result depends on the mesh.
        mesh_refinement: f64 = 1.0, "", Range::closed(0.25, 4.0);
        /// Mass-proportional Rayleigh damping of soft bodies (α, as air drag). The paper's engine uses 2.5.
        rayleigh_mass: f64 = 0.0, "1/s", Range::closed(0.0, 1e3);
        /// Stiffness-proportional Rayleigh damping (β) of soft bodies whose material has no loss factor. Implicit Euler
        /// adds its step. Equilibria do not depend on it.
        rayleigh_stiffness: f64 = 5e-3, "s", Range::closed(0.0, 1.0);
        /// True to integrate soft bodies by average acceleration, which adds next to no damping; false for implicit
        /// Euler, whose step damps motion.
        average_acceleration: bool = true;
        /// Dissipation time scale τ_d of contact springs, s (Castro et al. 2022). A surface that recedes faster
        /// than the springs relax is released; the value is small compared with `dt`, so that friction does not
        /// lift a sliding surface.
        dissipation_time: f64 = 5e-3, "s", Range::closed(0.0, 1.0);
        /// Normal contact stiffness per area of nearly rigid colliders, Pa/m: near rigid for Young's moduli
        /// up to 1 MPa.
        rigid_modulus: f64 = 1e9, "Pa/m", Range::above(0.0, 1e12);
        /// Tangential over normal contact stiffness. Mindlin (1949) gives 0.5 to 0.8 for solids; creep does
        /// not depend on it.
        shear_ratio: f64 = 0.5, "", Range::above(0.0, 10.0);
        /// Gap below which a sample becomes a contact point. A sample that will reach the surface within 1.5 steps
        /// becomes one as well.
        margin: f64 = 2e-4, "m", Range::above(0.0, 0.01);
        /// Speed below which a body may fall asleep.
        sleep_speed: f64 = 1e-4, "m/s", Range::closed(0.0, 1.0);
        /// Time for which a body must be that slow before it sleeps.
        sleep_delay: f64 = 0.5, "s", Range::above(0.0, 60.0);
        /// True if bodies may fall asleep at all.
        sleeping: bool = true;
        /// Longest time for which an element may be inverted before the run is invalid.
        max_inverted_time: f64 = 0.1, "s", Range::closed(0.0, 60.0);
        /// Largest speed of a valid state, m/s: far above that of a gripper (0.2 m/s), an arm, or a fall onto a table.
        max_speed: f64 = 100.0, "m/s", Range::above(0.0, 1e3);
    }
}
