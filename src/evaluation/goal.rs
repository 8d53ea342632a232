//! The predicate of a placement: the target rests at a place, released, for long enough. [`super::goal_tree`] combines
//! predicates to goals.
//!
//! Once per control step the target *rests at the place* if
//! 1. its centre is over (`On`) or inside (`Inside`) the [`GoalRegion`],
//! 2. at least [`support_share`](SuccessCriteria::support_share) of its weight, mean over the control step, is carried
//!    by the object at the goal, or (`Inside`) by objects in it that it carries in turn,
//! 3. no part of the robot pressed on it at any physics step of the control step.
//!
//! The predicate holds when this held for ⌈hold time / control step⌉ control steps in a row, at least one. A target
//! that has rested for one control step where it must be at the end, and leaves it later, counts as dropped
//! ([`super::drop::DropReason::LeftGoal`]).

use softvt_geometry::{Aabb, Pose, Vec3};

/// Cosine of the largest angle between the z axis of a container and the vertical, 45°.
const MIN_UPRIGHT: f64 = std::f64::consts::FRAC_1_SQRT_2;

use super::criteria::SuccessCriteria;

/// Region in which the target must come to rest, in the object frame of the object it is placed on or in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GoalRegion {
    /// On the object: carried by it, centre within a vertical cylinder about the origin of its frame.
    On {
        /// Radius of the cylinder, m.
        radius_m: f64,
    },
    /// Inside the object: centre in its cavity, carried by it or by objects in it.
    Inside {
        /// Box around the cavity ([`softvt_geometry::cavity`]), up to the top of the object, m.
        space: Aabb,
    },
}

impl GoalRegion {
    /// True if a centre at `centre_w` is over (`On`) or inside (`Inside`) the region of an object at `object_w`,
    /// enlarged by `margin_m` on every side.
    ///
    /// `On` is a horizontal distance in the world frame, independent of the object's tilt and height. `Inside`
    /// is a box in the frame of the object, whose z axis must be within 45° of the vertical.
    pub fn contains(&self, object_w: &Pose, centre_w: &Vec3, margin_m: f64) -> bool {
        match self {
            Self::On { radius_m } => {
                let offset = centre_w - object_w.translation.vector;
                offset.xy().norm() <= radius_m + margin_m
            }
            Self::Inside { space } => {
                let p = object_w.inverse_transform_point(&(*centre_w).into());
                let is_upright = (object_w.rotation * Vec3::z()).z >= MIN_UPRIGHT;
                is_upright && space.loosened(margin_m).contains(&p.coords)
            }
        }
    }

    /// True if a centre at `centre_w` is over the region of an object at `object_w`, at any height.
    pub fn is_over(&self, object_w: &Pose, centre_w: &Vec3) -> bool {
        match self {
            Self::On { .. } => self.contains(object_w, centre_w, 0.0),
            Self::Inside { space } => {
                let p = object_w.inverse_transform_point(&(*centre_w).into());
                (0..2).all(|i| p[i] >= space.min[i] && p[i] <= space.max[i])
            }
        }
    }

    /// The looser predicate of SoftVTBench's released code: true if both centres are closer than
    /// a distance, horizontally and vertically ([`goal_v1_on_m`](SuccessCriteria::goal_v1_on_m),
    /// [`goal_v1_in_m`](SuccessCriteria::goal_v1_in_m)).
    pub fn contains_v1(&self, criteria: &SuccessCriteria, object_w: &Pose, centre_w: &Vec3) -> bool {
        let reach = match self {
            Self::On { .. } => criteria.goal_v1_on_m,
            Self::Inside { .. } => criteria.goal_v1_in_m,
        };
        let offset = centre_w - object_w.translation.vector;
        offset.xy().norm() < reach && offset.z.abs() < reach
    }
}

/// One control step as [`PlacementMonitor`] reads it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacementSample {
    /// True if the centre is in the goal region at the end of the control step.
    pub is_inside: bool,
    /// True if it is in the region enlarged by [`SuccessCriteria::leave_margin_m`].
    pub is_inside_with_margin: bool,
    /// True if the place carries its share of the weight, mean over the control step.
    pub is_supported: bool,
    /// True if a pad or another part of the robot pressed on the target at any time in the control step.
    pub is_touched: bool,
    /// True if the predicate of the released code holds.
    pub is_inside_v1: bool,
}

impl PlacementSample {
    /// The sample of a predicate that is not a placement.
    pub fn given(holds: bool) -> Self {
        Self {
            is_inside: holds,
            is_inside_with_margin: true,
            is_supported: true,
            is_touched: false,
            is_inside_v1: holds,
        }
    }
}

/// Counts consecutive control steps at a place.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PlacementMonitor {
    steps_needed: u32,
    steps: u32,
    steps_v1: u32,
    has_entered: bool,
}

impl PlacementMonitor {
    /// Monitor of a placement that must last for `hold_s`, sampled every `control_s`; at least one control step.
    pub fn new(hold_s: f64, control_s: f64) -> Self {
        let steps_needed = (hold_s / control_s - 1e-6).ceil().max(1.0) as u32;
        Self { steps_needed, ..Self::default() }
    }

    /// Takes in one control step. Returns true if the target has rested at the place before and is now outside of the
    /// region enlarged by the margin.
    pub fn update(&mut self, sample: &PlacementSample) -> bool {
        let rests = sample.is_inside && sample.is_supported && !sample.is_touched;
        self.steps = if rests { self.steps + 1 } else { 0 };
        self.steps_v1 = if sample.is_inside_v1 { self.steps_v1 + 1 } else { 0 };
        self.has_entered |= rests;
        self.has_entered && !sample.is_inside_with_margin
    }

    /// True if the target has rested at the place for long enough, up to now.
    pub fn holds(&self) -> bool {
        self.steps >= self.steps_needed
    }

    /// True if the predicate of the released code has held for as long, up to now.
    pub fn holds_v1(&self) -> bool {
        self.steps_v1 >= self.steps_needed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f64, z: f64) -> Vec3 {
        Vec3::new(x, 0.0, z)
    }

    fn step(rests: bool) -> PlacementSample {
        PlacementSample {
            is_inside: rests,
            is_inside_with_margin: true,
            is_supported: true,
            is_touched: false,
            is_inside_v1: true,
        }
    }

    #[test]
    fn on_is_the_radius_of_the_plate_about_its_centre() {
        let plate = GoalRegion::On { radius_m: 0.08 };
        let pose = Pose::translation(0.1, 0.0, 0.0);
        assert!(plate.contains(&pose, &at(0.179, 0.03), 0.0));
        assert!(!plate.contains(&pose, &at(0.181, 0.03), 0.0));
        assert!(plate.contains(&pose, &at(0.184, 0.03), 0.005));
    }

    #[test]
    fn in_is_the_space_between_the_walls_of_a_turned_basket() {
        let space = Aabb { min: Vec3::new(-0.1, -0.05, 0.0), max: Vec3::new(0.1, 0.05, 0.08) };
        let basket = GoalRegion::Inside { space };
        let turned = Pose::rotation(Vec3::z() * std::f64::consts::FRAC_PI_2);
        assert!(basket.contains(&Pose::identity(), &at(0.09, 0.03), 0.0));
        assert!(!basket.contains(&turned, &at(0.09, 0.03), 0.0));
        assert!(!basket.contains(&Pose::identity(), &at(0.0, 0.09), 0.0), "above the rim");
    }

    #[test]
    fn a_tipped_container_has_no_inside() {
        let space = Aabb { min: Vec3::new(-0.1, -0.1, 0.0), max: Vec3::new(0.1, 0.1, 0.2) };
        let basket = GoalRegion::Inside { space };
        for (degrees, contains) in [(0.0, true), (44.0, true), (46.0, false), (90.0, false), (180.0, false)] {
            let tipped = Pose::rotation(Vec3::x() * f64::to_radians(degrees));
            let centre = (tipped * nalgebra::Point3::new(0.0, 0.0, 0.1)).coords;
            assert_eq!(basket.contains(&tipped, &centre, 0.0), contains, "{degrees}°");
        }
    }

    #[test]
    fn the_released_predicate_is_looser() {
        let (criteria, pose) = (SuccessCriteria::default(), Pose::identity());
        let plate = GoalRegion::On { radius_m: 0.08 };
        assert!(plate.contains_v1(&criteria, &pose, &at(0.099, 0.05)));
        assert!(!plate.contains_v1(&criteria, &pose, &at(0.101, 0.05)));
        assert!(!plate.contains_v1(&criteria, &pose, &at(0.0, 0.11)));
        let basket = GoalRegion::Inside { space: Aabb { min: Vec3::zeros(), max: Vec3::zeros() } };
        assert!(basket.contains_v1(&criteria, &pose, &at(0.199, 0.19)));
    }

    #[test]
    fn eight_control_steps_in_a_row_are_needed() {
        let mut goal = PlacementMonitor::new(0.4, 0.05);
        (0..7).for_each(|_| assert!(!goal.update(&step(true))));
        goal.update(&step(false));
        (0..7).for_each(|_| assert!(!goal.update(&step(true))));
        assert!(!goal.holds() && goal.holds_v1());
        goal.update(&step(true));
        assert!(goal.holds());
        goal.update(&step(false));
        assert!(!goal.holds());
    }

    #[test]
    fn a_hold_of_zero_still_takes_one_control_step() {
        let mut goal = PlacementMonitor::new(0.0, 0.05);
        goal.update(&step(false));
        assert!(!goal.holds());
        goal.update(&step(true));
        assert!(goal.holds());
    }

    #[test]
    fn held_unsupported_or_outside_is_not_at_rest() {
        for sample in [
            PlacementSample { is_touched: true, ..step(true) },
            PlacementSample { is_supported: false, ..step(true) },
            PlacementSample { is_inside: false, ..step(true) },
        ] {
            let mut goal = PlacementMonitor::new(0.05, 0.05);
            goal.update(&sample);
            assert!(!goal.holds(), "{sample:?}");
        }
    }

    #[test]
    fn only_a_goal_that_was_entered_can_be_left() {
        let mut goal = PlacementMonitor::new(0.4, 0.05);
        let outside = PlacementSample { is_inside: false, is_inside_with_margin: false, ..step(false) };
        assert!(!goal.update(&outside), "carried past");
        goal.update(&step(true));
        assert!(!goal.update(&PlacementSample { is_inside_with_margin: true, ..outside }), "on the margin");
        assert!(goal.update(&outside));
    }
}
