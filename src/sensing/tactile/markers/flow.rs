//! Marker flow: the motion of the markers of one finger as a few numbers.
//!
//! The displacement u of the markers at x is split as in the theory of small strains: u = ū + G (x − x̄) + residual,
//! with the mean ū and the gradient G of the least-squares plane. The trace of G is the divergence (a dent pushes
//! markers outwards), its antisymmetric part the twist, and its trace-free symmetric part the shear. All lengths are
//! in px of the image (x right, y down).

use nalgebra::{Matrix2, Vector2};

use super::{MARKER_COUNT, Markers};

/// Motion of the markers of one finger from their initial to their current positions.
#[derive(Clone, Debug, PartialEq)]
pub struct MarkerFlow {
    /// Initial positions from their mean, px.
    arms: [Vector2<f64>; MARKER_COUNT],
    /// Displacement of each marker, row by row, px.
    pub displacements: [Vector2<f64>; MARKER_COUNT],
}

impl MarkerFlow {
    /// Flow of `markers`.
    pub fn new(markers: &Markers) -> Self {
        let [initial, current] =
            markers.to_array().map(|positions| positions.map(|px| Vector2::from(px.map(f64::from))));
        let centre = mean(&initial);
        Self {
            arms: initial.map(|position| position - centre),
            displacements: std::array::from_fn(|m| current[m] - initial[m]),
        }
    }

    /// Mean displacement, px: the gel is sheared along its surface.
    pub fn mean(&self) -> [f64; 2] {
        mean(&self.displacements).into()
    }

    /// Gradient of the least-squares plane through the displacements, `[[∂u/∂x, ∂u/∂y], [∂v/∂x, ∂v/∂y]]`, px per px.
    pub fn gradient(&self) -> [[f64; 2]; 2] {
        let (mut square, mut cross) = (Matrix2::zeros(), Matrix2::zeros());
        for (arm, displacement) in self.arms.iter().zip(&self.displacements) {
            square += arm * arm.transpose();
            cross += displacement * arm.transpose();
        }
        let (xx, xy, yy) = (square.m11, square.m12, square.m22);
        let det = xx * yy - xy * xy;
        [0, 1].map(|axis| {
            let (a, b) = (cross[(axis, 0)], cross[(axis, 1)]);
            [(a * yy - b * xy) / det, (b * xx - a * xy) / det]
        })
    }

    /// Trace of the gradient; positive where a dent pushes the markers outwards.
    pub fn divergence(&self) -> f64 {
        let [[xx, _], [_, yy]] = self.gradient();
        xx + yy
    }

    /// Rotation of the markers, rad (small). Positive from image x towards image y, clockwise in the image.
    pub fn twist(&self) -> f64 {
        let [[_, xy], [yx, _]] = self.gradient();
        0.5 * (yx - xy)
    }

    /// Pure shear: stretch along x minus that along y, and stretch along the diagonal x = y, each halved.
    pub fn shear(&self) -> [f64; 2] {
        let [[xx, xy], [yx, yy]] = self.gradient();
        [0.5 * (xx - yy), 0.5 * (xy + yx)]
    }

    /// Length of the longest displacement, px.
    pub fn max_displacement(&self) -> f64 {
        self.displacements.iter().map(|u| u.x.hypot(u.y)).fold(0.0, f64::max)
    }

    /// True for each marker that has moved by more than `px`.
    pub fn moved(&self, px: f64) -> [bool; MARKER_COUNT] {
        self.displacements.map(|u| u.x.hypot(u.y) > px)
    }

    /// Share of the markers that have moved by more than `px`, 0 to 1: about the share of the image in contact.
    pub fn moved_share(&self, px: f64) -> f64 {
        self.moved(px).iter().filter(|moved| **moved).count() as f64 / MARKER_COUNT as f64
    }

    /// Measure of the pressing force, px: root mean square of the displacement without its mean and twist.
    ///
    /// It grows with the normal force, steeply for round or hard objects and less for flat and soft ones, and is
    /// unaffected by shear along the surface. Converting it to N requires knowing the object.
    pub fn press(&self) -> f64 {
        let ([x, y], twist) = (self.mean(), self.twist());
        let square = |(arm, u): (&Vector2<f64>, &Vector2<f64>)| {
            (u.x - x + twist * arm.y).powi(2) + (u.y - y - twist * arm.x).powi(2)
        };
        let sum: f64 = self.arms.iter().zip(&self.displacements).map(square).sum();
        (sum / MARKER_COUNT as f64).sqrt()
    }

    /// Measure of the force that pulls the object out of the grasp, px: length of the mean displacement, without its
    /// part towards the hand (+x), which pushes the object further in.
    pub fn drag(&self) -> f64 {
        let [x, y] = self.mean();
        x.min(0.0).hypot(y)
    }
}

fn mean(all: &[Vector2<f64>; MARKER_COUNT]) -> Vector2<f64> {
    all.iter().fold(Vector2::zeros(), |sum, x| sum + x) / MARKER_COUNT as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Flow of markers moved by a function of their position from the centre of the image.
    fn moved(by: impl Fn(f64, f64) -> [f64; 2]) -> MarkerFlow {
        let initial = Markers::at_rest().initial;
        let current = initial.map(|[x, y]| {
            let [u, v] = by(f64::from(x) - 160.0, f64::from(y) - 120.0);
            [x + u as f32, y + v as f32]
        });
        MarkerFlow::new(&Markers { initial, current })
    }

    fn near(found: f64, expected: f64) {
        assert!((found - expected).abs() < 2e-5, "{found} instead of {expected}");
    }

    #[test]
    fn a_translation_is_all_mean_and_neither_press_nor_twist() {
        let flow = moved(|_, _| [-0.75, 0.5]);
        near(flow.mean()[0], -0.75);
        near(flow.mean()[1], 0.5);
        [flow.divergence(), flow.twist(), flow.press()].into_iter().for_each(|x| near(x, 0.0));
        near(flow.max_displacement(), 0.75_f64.hypot(0.5));
        near(flow.drag(), 0.75_f64.hypot(0.5));
        near(moved(|_, _| [0.75, 0.5]).drag(), 0.5);
    }

    #[test]
    fn a_rotation_is_all_twist() {
        let angle: f64 = 0.01;
        let flow = moved(|x, y| {
            [(angle.cos() - 1.0) * x - angle.sin() * y, angle.sin() * x + (angle.cos() - 1.0) * y]
        });
        near(flow.twist(), angle.sin());
        near(flow.divergence(), 2.0 * (angle.cos() - 1.0));
        flow.shear().into_iter().for_each(|x| near(x, 0.0));
        assert!(flow.press() < 0.01, "{}", flow.press());
    }

    #[test]
    fn a_dilation_is_all_divergence_and_presses_by_its_root_mean_square() {
        let flow = moved(|x, y| [0.01 * x, 0.01 * y]);
        near(flow.divergence(), 0.02);
        near(flow.twist(), 0.0);
        let arms = Markers::at_rest().initial.map(|[x, y]| [f64::from(x) - 160.0, f64::from(y) - 120.0]);
        let square: f64 = arms.iter().map(|[x, y]| x * x + y * y).sum::<f64>() / MARKER_COUNT as f64;
        assert!((flow.press() - 0.01 * square.sqrt()).abs() < 1e-4);
    }

    #[test]
    fn pure_shears_are_distinguished() {
        let along = moved(|x, y| [0.01 * x, -0.01 * y]);
        near(along.shear()[0], 0.01);
        near(along.shear()[1], 0.0);
        let diagonal = moved(|x, y| [0.01 * y, 0.01 * x]);
        near(diagonal.shear()[0], 0.0);
        near(diagonal.shear()[1], 0.01);
        // A simple shear is half a pure one and half a rotation.
        let simple = moved(|_, y| [0.01 * y, 0.0]);
        near(simple.shear()[1], 0.005);
        near(simple.twist(), -0.005);
    }

    #[test]
    fn moved_markers_are_counted() {
        let flow = moved(|x, _| if x < -80.0 { [0.6, 0.0] } else { [0.0, 0.0] });
        // Three columns of nine.
        assert_eq!(flow.moved(0.5).iter().filter(|m| **m).count(), 27);
        assert!(flow.moved(0.5)[0] && !flow.moved(0.5)[10]);
        near(flow.moved_share(0.5), 27.0 / 99.0);
        near(flow.moved_share(0.7), 0.0);
    }
}
