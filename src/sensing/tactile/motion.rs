//! What the motion of a finger's markers says of a touch: a few numbers in px of the picture (x right, y down), as plain
//! functions of the places of the markers.
//!
//! The motion u of the markers at x is split as in any text on small strains: u = ū + G (x − x̄) + rest, where ū is the mean
//! and G the gradient of the least-squares plane. Of G, the trace is the divergence (a dent pushes markers outwards), the
//! antisymmetric part the twist and the trace-free symmetric part the shear.

use super::{MARKERS, Markers};

/// How the markers of one finger have moved.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Untouched places from their mean, px.
    arms: [[f64; 2]; MARKERS],
    /// How far each has moved, px.
    moves: [[f64; 2]; MARKERS],
}

impl Motion {
    /// From initial and present places.
    pub fn of(markers: &Markers) -> Self {
        let [initial, present] = markers;
        let middle = mean(&initial.map(|place| place.map(f64::from)));
        Self {
            arms: initial.map(|place| [0, 1].map(|axis| f64::from(place[axis]) - middle[axis])),
            moves: std::array::from_fn(|m| {
                [0, 1].map(|axis| f64::from(present[m][axis]) - f64::from(initial[m][axis]))
            }),
        }
    }

    /// How far each marker has moved, row by row, px.
    pub fn moves(&self) -> &[[f64; 2]; MARKERS] {
        &self.moves
    }

    /// Mean motion, px: the gel is dragged along its surface.
    pub fn mean(&self) -> [f64; 2] {
        mean(&self.moves)
    }

    /// Gradient of the least-squares plane through the motion: `[[∂u/∂x, ∂u/∂y], [∂v/∂x, ∂v/∂y]]`, px a px.
    pub fn gradient(&self) -> [[f64; 2]; 2] {
        let mut square = [0.0; 3];
        let mut cross = [[0.0; 2]; 2];
        for ([x, y], motion) in self.arms.iter().zip(&self.moves) {
            square = [square[0] + x * x, square[1] + x * y, square[2] + y * y];
            for axis in 0..2 {
                cross[axis][0] += motion[axis] * x;
                cross[axis][1] += motion[axis] * y;
            }
        }
        let [xx, xy, yy] = square;
        let det = xx * yy - xy * xy;
        cross.map(|[a, b]| [(a * yy - b * xy) / det, (b * xx - a * xy) / det])
    }

    /// Trace of the gradient: positive where a dent pushes the markers outwards.
    pub fn divergence(&self) -> f64 {
        let [[xx, _], [_, yy]] = self.gradient();
        xx + yy
    }

    /// Turn of the markers, rad (small): positive turns image x towards image y, clockwise as seen.
    pub fn twist(&self) -> f64 {
        let [[_, xy], [yx, _]] = self.gradient();
        0.5 * (yx - xy)
    }

    /// Pure shear of the markers: stretch along x against y, and along the diagonal x = y.
    pub fn shear(&self) -> [f64; 2] {
        let [[xx, xy], [yx, yy]] = self.gradient();
        [0.5 * (xx - yy), 0.5 * (xy + yx)]
    }

    /// The longest motion, px.
    pub fn largest(&self) -> f64 {
        self.moves.iter().map(|[x, y]| x.hypot(*y)).fold(0.0, f64::max)
    }

    /// Which markers have moved by more than `px`.
    pub fn moved(&self, px: f64) -> [bool; MARKERS] {
        self.moves.map(|[x, y]| x.hypot(y) > px)
    }

    /// Share of the picture over which markers have moved by more than `px`, 0..=1: each marker stands for as much of it as
    /// every other.
    pub fn moved_share(&self, px: f64) -> f64 {
        self.moved(px).iter().filter(|moved| **moved).count() as f64 / MARKERS as f64
    }

    /// How hard the gel is pressed, px: root mean square of the motion that is neither mean nor twist. It grows with the
    /// normal force, steeply for what is round or hard and less for what is flat and soft, and knows no drag; to say it in N
    /// one must know what is touched.
    pub fn press(&self) -> f64 {
        let ([x, y], twist) = (self.mean(), self.twist());
        let rest = |([ax, ay], [u, v]): (&[f64; 2], &[f64; 2])| {
            (u - x + twist * ay).powi(2) + (v - y - twist * ax).powi(2)
        };
        (self.arms.iter().zip(&self.moves).map(rest).sum::<f64>() / MARKERS as f64).sqrt()
    }

    /// How hard something is on its way out of the grasp, px: mean motion towards the fingertip (−x) or across; pushing it
    /// further in is no drag.
    pub fn drag(&self) -> f64 {
        let [x, y] = self.mean();
        x.min(0.0).hypot(y)
    }
}

fn mean(all: &[[f64; 2]; MARKERS]) -> [f64; 2] {
    all.iter().fold([0.0; 2], |sum, [x, y]| [sum[0] + x, sum[1] + y]).map(|sum| sum / MARKERS as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sensing::tactile::untouched;

    /// Markers moved by a function of their arm from the middle of the picture.
    fn moved(by: impl Fn(f64, f64) -> [f64; 2]) -> Motion {
        let initial = untouched();
        let present = initial.map(|[x, y]| {
            let [u, v] = by(f64::from(x) - 160.0, f64::from(y) - 120.0);
            [x + u as f32, y + v as f32]
        });
        Motion::of(&[initial, present])
    }

    fn near(found: f64, expected: f64) {
        assert!((found - expected).abs() < 2e-5, "{found} instead of {expected}");
    }

    #[test]
    fn a_translation_is_all_mean_and_neither_press_nor_twist() {
        let motion = moved(|_, _| [-0.75, 0.5]);
        near(motion.mean()[0], -0.75);
        near(motion.mean()[1], 0.5);
        [motion.divergence(), motion.twist(), motion.press()].into_iter().for_each(|x| near(x, 0.0));
        near(motion.largest(), 0.75_f64.hypot(0.5));
        near(motion.drag(), 0.75_f64.hypot(0.5));
        near(moved(|_, _| [0.75, 0.5]).drag(), 0.5);
    }

    #[test]
    fn a_turn_is_all_twist() {
        let angle: f64 = 0.01;
        let motion = moved(|x, y| {
            [(angle.cos() - 1.0) * x - angle.sin() * y, angle.sin() * x + (angle.cos() - 1.0) * y]
        });
        near(motion.twist(), angle.sin());
        near(motion.divergence(), 2.0 * (angle.cos() - 1.0));
        motion.shear().into_iter().for_each(|x| near(x, 0.0));
        assert!(motion.press() < 0.01, "{}", motion.press());
    }

    #[test]
    fn a_swelling_is_all_divergence_and_presses_by_its_root_mean_square() {
        let motion = moved(|x, y| [0.01 * x, 0.01 * y]);
        near(motion.divergence(), 0.02);
        near(motion.twist(), 0.0);
        let arms = untouched().map(|[x, y]| [f64::from(x) - 160.0, f64::from(y) - 120.0]);
        let square: f64 = arms.iter().map(|[x, y]| x * x + y * y).sum::<f64>() / MARKERS as f64;
        assert!((motion.press() - 0.01 * square.sqrt()).abs() < 1e-4);
    }

    #[test]
    fn pure_shears_are_told_apart() {
        let along = moved(|x, y| [0.01 * x, -0.01 * y]);
        near(along.shear()[0], 0.01);
        near(along.shear()[1], 0.0);
        let diagonal = moved(|x, y| [0.01 * y, 0.01 * x]);
        near(diagonal.shear()[0], 0.0);
        near(diagonal.shear()[1], 0.01);
        // A simple shear is half a pure one and half a turn.
        let simple = moved(|_, y| [0.01 * y, 0.0]);
        near(simple.shear()[1], 0.005);
        near(simple.twist(), -0.005);
    }

    #[test]
    fn the_contact_is_where_markers_have_moved() {
        let motion = moved(|x, _| if x < -80.0 { [0.6, 0.0] } else { [0.0, 0.0] });
        // Three columns of nine.
        assert_eq!(motion.moved(0.5).iter().filter(|m| **m).count(), 27);
        assert!(motion.moved(0.5)[0] && !motion.moved(0.5)[10]);
        near(motion.moved_share(0.5), 27.0 / 99.0);
        near(motion.moved_share(0.7), 0.0);
    }
}
