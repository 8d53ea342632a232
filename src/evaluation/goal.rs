//! The goal: the target rests where it must, released, for long enough.

use crate::{
    geometry::{Pose, Vec3},
    scene::Region,
};

use super::rules::Rules;

/// Where the target must come to rest, in the object frame of what it is placed on or in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// On it: carried by it, centre within the radius.
    On {
        /// Radius about the object frame's origin, m.
        radius_m: f64,
    },
    /// In it: centre inside its walls and carried by whatever is in there.
    In {
        /// The room between its walls, up to the rim.
        inside: Region,
    },
}

impl Place {
    /// Whether a centre at `centre_w` is over (`On`) or inside (`In`) a place at `place_w` that reaches `margin_m`
    /// further than it does.
    pub fn holds(&self, place_w: &Pose, centre_w: &Vec3, margin_m: f64) -> bool {
        match self {
            Self::On { radius_m } => {
                let offset = centre_w - place_w.translation.vector;
                offset.xy().norm() <= radius_m + margin_m
            }
            Self::In { inside } => {
                let p = place_w.inverse_transform_point(&(*centre_w).into());
                (0..3).all(|i| p[i] >= inside.min[i] - margin_m && p[i] <= inside.max[i] + margin_m)
            }
        }
    }

    /// The released SoftVTBench code's loose predicate: centres within a horizontal and a vertical distance.
    pub fn holds_v1(&self, rules: &Rules, place_w: &Pose, centre_w: &Vec3) -> bool {
        let reach = match self {
            Self::On { .. } => rules.goal_v1_on_m,
            Self::In { .. } => rules.goal_v1_in_m,
        };
        let offset = centre_w - place_w.translation.vector;
        offset.xy().norm() < reach && offset.z.abs() < reach
    }
}

/// One control step, as the goal sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// End of the control step, s.
    pub time_s: f64,
    /// The centre is over or inside the place.
    pub inside: bool,
    /// The same with the margin that leaving takes.
    pub inside_with_margin: bool,
    /// The place carries its share of the weight, mean over the control step.
    pub supported: bool,
    /// A pad or another part of the robot pressed on the target at any time in the control step.
    pub touched: bool,
    /// The released code's predicate.
    pub v1: bool,
}

/// Counts control steps at the goal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GoalWatch {
    steps_needed: u32,
    steps: u32,
    steps_v1: u32,
    entered: bool,
    reached_s: Option<f64>,
    reached_v1: bool,
}

impl GoalWatch {
    /// A goal that must hold for `hold_s`, looked at every `control_s`; at least one control step.
    pub fn new(hold_s: f64, control_s: f64) -> Self {
        let steps_needed = (hold_s / control_s - 1e-6).ceil().max(1.0) as u32;
        Self { steps_needed, steps: 0, steps_v1: 0, entered: false, reached_s: None, reached_v1: false }
    }

    /// Looks at one control step; says whether the target has now left a goal that it had reached.
    pub fn observe(&mut self, placement: &Placement) -> bool {
        let rests = placement.inside && placement.supported && !placement.touched;
        self.steps = if rests { self.steps + 1 } else { 0 };
        self.steps_v1 = if placement.v1 { self.steps_v1 + 1 } else { 0 };
        self.entered |= rests;
        if self.steps >= self.steps_needed {
            self.reached_s.get_or_insert(placement.time_s);
        }
        self.reached_v1 |= self.steps_v1 >= self.steps_needed;
        self.entered && !placement.inside_with_margin
    }

    /// When the goal had held for long enough, s.
    pub fn reached_s(&self) -> Option<f64> {
        self.reached_s
    }

    /// Whether the released code's predicate has held for as long.
    pub fn reached_v1(&self) -> bool {
        self.reached_v1
    }

    /// Whether the target rests at the goal now, held long enough or not.
    pub fn rests(&self) -> bool {
        self.steps > 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f64, z: f64) -> Vec3 {
        Vec3::new(x, 0.0, z)
    }

    fn step(rests: bool) -> Placement {
        Placement {
            time_s: 0.0,
            inside: rests,
            inside_with_margin: true,
            supported: true,
            touched: false,
            v1: true,
        }
    }

    #[test]
    fn on_is_the_plates_radius_about_its_centre() {
        let plate = Place::On { radius_m: 0.08 };
        let pose = Pose::translation(0.1, 0.0, 0.0);
        assert!(plate.holds(&pose, &at(0.179, 0.03), 0.0));
        assert!(!plate.holds(&pose, &at(0.181, 0.03), 0.0));
        assert!(plate.holds(&pose, &at(0.184, 0.03), 0.005));
    }

    #[test]
    fn in_is_the_room_between_the_walls_of_a_turned_basket() {
        let inside = Region { min: Vec3::new(-0.1, -0.05, 0.0), max: Vec3::new(0.1, 0.05, 0.08) };
        let basket = Place::In { inside };
        let turned = Pose::rotation(Vec3::z() * std::f64::consts::FRAC_PI_2);
        assert!(basket.holds(&Pose::identity(), &at(0.09, 0.03), 0.0));
        assert!(!basket.holds(&turned, &at(0.09, 0.03), 0.0));
        assert!(!basket.holds(&Pose::identity(), &at(0.0, 0.09), 0.0), "above the rim");
    }

    #[test]
    fn the_released_predicate_is_looser() {
        let (rules, pose) = (Rules::default(), Pose::identity());
        let plate = Place::On { radius_m: 0.08 };
        assert!(plate.holds_v1(&rules, &pose, &at(0.099, 0.05)));
        assert!(!plate.holds_v1(&rules, &pose, &at(0.101, 0.05)));
        assert!(!plate.holds_v1(&rules, &pose, &at(0.0, 0.11)));
        let basket = Place::In { inside: Region { min: Vec3::zeros(), max: Vec3::zeros() } };
        assert!(basket.holds_v1(&rules, &pose, &at(0.199, 0.19)));
    }

    #[test]
    fn eight_control_steps_in_a_row_are_needed() {
        let mut goal = GoalWatch::new(0.4, 0.05);
        (0..7).for_each(|_| assert!(!goal.observe(&step(true))));
        goal.observe(&step(false));
        (0..7).for_each(|_| assert!(!goal.observe(&step(true))));
        assert_eq!(goal.reached_s(), None);
        assert!(goal.rests());
        goal.observe(&Placement { time_s: 0.8, ..step(true) });
        assert_eq!(goal.reached_s(), Some(0.8));
        assert!(goal.reached_v1());
    }

    #[test]
    fn a_hold_of_zero_still_takes_one_control_step() {
        let mut goal = GoalWatch::new(0.0, 0.05);
        goal.observe(&step(false));
        assert_eq!(goal.reached_s(), None);
        goal.observe(&step(true));
        assert_eq!(goal.reached_s(), Some(0.0));
    }

    #[test]
    fn held_unsupported_or_outside_is_not_at_rest() {
        for placement in [
            Placement { touched: true, ..step(true) },
            Placement { supported: false, ..step(true) },
            Placement { inside: false, ..step(true) },
        ] {
            let mut goal = GoalWatch::new(0.05, 0.05);
            goal.observe(&placement);
            assert_eq!(goal.reached_s(), None, "{placement:?}");
        }
    }

    #[test]
    fn only_a_goal_that_was_entered_can_be_left() {
        let mut goal = GoalWatch::new(0.4, 0.05);
        let outside = Placement { inside: false, inside_with_margin: false, ..step(false) };
        assert!(!goal.observe(&outside), "carried past");
        goal.observe(&step(true));
        assert!(!goal.observe(&Placement { inside_with_margin: true, ..outside }), "on the margin");
        assert!(goal.observe(&outside));
    }
}
