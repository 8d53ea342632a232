//! The goal of a task in a scene: its objects, regions and joints.

use std::{fmt::Debug, sync::Arc};

use super::{
    asset_cache::AssetCache,
    episode_error::EpisodeError,
    evidence::foot_pose,
    simulation::{ObjectInstance, Simulation, placed_at},
};
use softvt_benchmark::{
    Placement, Task,
    goal::{Goal, Side, SubGoals},
};
use softvt_evaluation::{
    goal::GoalRegion,
    goal_tree::{GoalMonitor, GoalNode},
    judge::{Predicate, PredicateRule},
};
use softvt_geometry::{Aabb, Vec3};
use softvt_physics::BodyId;
use softvt_scene::Joint;

/// A function of the true state that a goal asks for ([`Goal::Predicate`]).
pub trait StatePredicate: Debug + Send + Sync {
    /// True if it holds.
    fn holds(&self, sim: &Simulation, time_s: f64) -> Result<bool, String>;
}

/// The goal of a task in a scene.
#[derive(Clone, Debug)]
pub(super) struct GoalInScene {
    /// Indices of the objects that the task moves; the first is *the object*.
    pub targets: Vec<usize>,
    pub goal: GoalNode,
    pub predicates: Vec<PredicateInScene>,
    /// Functions of the script, which some predicates call.
    functions: Vec<Arc<dyn StatePredicate>>,
}

/// A predicate of the goal; numbers are indices of objects where nothing else is said.
#[derive(Clone, Debug)]
pub(super) struct PredicateInScene {
    /// Description, as records show it.
    name: String,
    hold_s: f64,
    pub subject: Subject,
    /// True if it must not hold.
    is_negated: bool,
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Subject {
    /// A target (a place in [`GoalInScene::targets`]) rests in a region of an object.
    Rests { target: usize, on: usize, region: GoalRegion },
    /// The position of a joint is within a range.
    Joint { part: usize, range: [f64; 2] },
    /// The horizontal distance of two centres is at most this, m.
    Near { object: usize, target: usize, distance_m: f64 },
    /// The centre of an object is beyond another towards a side by at least this, m.
    Beside { object: usize, target: usize, side: Side, distance_m: f64 },
    /// The z axis of an object is within an angle of the vertical, given by its cosine.
    Upright { object: usize, least_cosine: f64 },
    /// A function of the script, by its place in [`GoalInScene::functions`].
    Function(usize),
}

struct Finder<'a> {
    task: &'a Task,
    sim: &'a Simulation,
    cache: &'a AssetCache,
    found: GoalInScene,
}

impl GoalInScene {
    /// The goal of a task. The scene need not have settled. `functions` are those of its
    /// [`Goal::Predicate`]s, in order.
    pub(super) fn find(
        task: &Task,
        sim: &Simulation,
        cache: &AssetCache,
        functions: &[Arc<dyn StatePredicate>],
    ) -> Result<Self, EpisodeError> {
        let functions = functions.to_vec();
        let goal = GoalNode::All(Vec::new());
        let found = Self { targets: Vec::new(), goal, predicates: Vec::new(), functions };
        let mut finder = Finder { task, sim, cache, found };
        for name in task.targets() {
            let index = finder.index_of("object", name)?;
            finder.found.targets.push(index);
        }
        let goal = finder.node(&task.goal)?;
        goal.for_each_negated(&mut |number| finder.found.predicates[number].is_negated = true);
        finder.found.goal = goal;
        let has_placement =
            finder.found.predicates.iter().any(|p| matches!(p.subject, Subject::Rests { .. }));
        if has_placement && sim.scene.gravity.z >= 0.0 {
            return Err(EpisodeError::Gravity {
                task: task.id,
                object: task.object.clone(),
                gravity: sim.scene.gravity,
                placed_at: placed_at(&sim.scene, &task.object),
            });
        }
        Ok(finder.found)
    }

    /// The predicates as the judge reads them.
    pub(super) fn judged(&self) -> Vec<Predicate> {
        let judged = |PredicateInScene { name, hold_s, subject, .. }: &PredicateInScene| Predicate {
            name: name.clone(),
            rule: match *subject {
                Subject::Rests { target, region, .. } => {
                    PredicateRule::Rests { target, region, hold_s: *hold_s }
                }
                _ => PredicateRule::Given { hold_s: *hold_s },
            },
        };
        self.predicates.iter().map(judged).collect()
    }

    /// True if an object is one on or in which a target must rest.
    pub(super) fn is_place(&self, object: usize) -> bool {
        self.predicates.iter().any(|p| matches!(p.subject, Subject::Rests { on, .. } if on == object))
    }

    /// True if a predicate holds; placements have another function. `is_touched` says of an object whether the robot
    /// presses on it, which does not matter to negated predicates.
    pub(super) fn holds(
        &self,
        predicate: usize,
        sim: &Simulation,
        time_s: f64,
        is_touched: impl Fn(usize) -> bool,
    ) -> Result<bool, String> {
        let PredicateInScene { subject, is_negated, .. } = self.predicates[predicate];
        let is_touched = |object: usize| !is_negated && is_touched(object);
        let centre = |index: usize| sim.centre(&sim.objects[index]);
        let offset_b = |object: usize, target: usize| {
            sim.robot.base_w.rotation.inverse() * (centre(object) - centre(target))
        };
        Ok(match subject {
            Subject::Rests { .. } => false,
            Subject::Joint { part, range: [low, high] } => {
                sim.joint(&sim.objects[part]).is_some_and(|q| (low..=high).contains(&q))
            }
            Subject::Near { object, target, distance_m } => {
                !is_touched(object) && offset_b(object, target).xy().norm() <= distance_m
            }
            Subject::Beside { object, target, side, distance_m } => {
                let offset = offset_b(object, target);
                let [towards, across] = match side {
                    Side::LeftOf => [offset.y, offset.x],
                    Side::RightOf => [-offset.y, offset.x],
                    Side::InFrontOf => [-offset.x, offset.y],
                    Side::Behind => [offset.x, offset.y],
                };
                !is_touched(object) && towards >= distance_m && across.abs() <= towards
            }
            Subject::Upright { object, least_cosine } => {
                let axis = sim.pose(&sim.objects[object]).rotation * Vec3::z();
                !is_touched(object) && axis.z >= least_cosine
            }
            Subject::Function(place) => match self.functions.get(place) {
                Some(function) => function.holds(sim, time_s)?,
                None => {
                    return Err(format!(
                        "the episode lacks the function of {:?}",
                        self.predicates[predicate].name
                    ));
                }
            },
        })
    }

    /// True if the goal may hold once the scene has settled. A conjunction may if each object is over its region, at
    /// any height, and the other predicates hold already.
    fn may_hold(&self, sim: &Simulation) -> bool {
        !is_conjunction(&self.goal)
            || (0..self.predicates.len()).all(|number| match self.predicates[number].subject {
                Subject::Rests { target, on, region } => {
                    let object = &sim.objects[self.targets[target]];
                    region.is_over(&foot_pose(sim, &sim.objects[on]), &sim.centre(object))
                }
                _ => self.holds(number, sim, 0.0, |_| false).unwrap_or(true),
            })
    }
}

impl Finder<'_> {
    fn index_of(&self, role: &'static str, name: &str) -> Result<usize, EpisodeError> {
        self.sim.objects.iter().position(|o| o.name == name).ok_or_else(|| EpisodeError::NoObject {
            task: self.task.id,
            role,
            name: name.to_owned(),
            layout: self.task.layout.clone(),
            have: self.sim.objects.iter().map(|o| o.name.as_str()).collect::<Vec<_>>().join(", "),
        })
    }

    fn nodes(&mut self, parts: &SubGoals) -> Result<Vec<GoalNode>, EpisodeError> {
        parts.goals.iter().map(|goal| self.node(goal)).collect()
    }

    fn node(&mut self, goal: &Goal) -> Result<GoalNode, EpisodeError> {
        let (hold_s, subject) = match goal {
            Goal::All(parts) => return self.nodes(parts).map(GoalNode::All),
            Goal::Any(parts) => return self.nodes(parts).map(GoalNode::Any),
            Goal::None(parts) => return self.nodes(parts).map(GoalNode::None),
            Goal::Sequence(parts) => return self.nodes(parts).map(GoalNode::Sequence),
            Goal::On(of) => (of.hold_s, self.placement(of, false)?),
            Goal::Inside(of) => (of.hold_s, self.placement(of, true)?),
            Goal::Near { of, distance_m } => {
                let [object, target] = self.pair(of)?;
                (of.hold_s, Subject::Near { object, target, distance_m: *distance_m })
            }
            Goal::Beside { side, of, distance_m } => {
                let [object, target] = self.pair(of)?;
                (of.hold_s, Subject::Beside { object, target, side: *side, distance_m: *distance_m })
            }
            Goal::Upright { object, hold_s, angle_rad } => {
                let object = self.index_of("object", object)?;
                (*hold_s, Subject::Upright { object, least_cosine: angle_rad.cos() })
            }
            Goal::Opened { joint, share } => {
                (0.0, self.joint(joint, |[low, high]| [low + share * (high - low), high])?)
            }
            Goal::Closed { joint, share } => {
                (0.0, self.joint(joint, |[low, high]| [low, low + share * (high - low)])?)
            }
            Goal::Turned { joint, range } => (0.0, self.joint(joint, |_| *range)?),
            Goal::Predicate { .. } => {
                let before = |p: &&PredicateInScene| matches!(p.subject, Subject::Function(_));
                (0.0, Subject::Function(self.found.predicates.iter().filter(before).count()))
            }
        };
        self.found.predicates.push(PredicateInScene {
            name: goal.describe(),
            hold_s,
            subject,
            is_negated: false,
        });
        Ok(GoalNode::Predicate(self.found.predicates.len() - 1))
    }

    fn pair(&self, of: &Placement) -> Result<[usize; 2], EpisodeError> {
        Ok([self.index_of("object", &of.object)?, self.index_of("target", &of.target)?])
    }

    fn placement(&self, of: &Placement, is_inside: bool) -> Result<Subject, EpisodeError> {
        let [object, on] = self.pair(of)?;
        let target = self.found.targets.iter().position(|target| *target == object).unwrap_or_default();
        let region = region_of(&self.sim.objects[on], is_inside, self.cache).ok_or_else(|| {
            let placed_at = placed_at(&self.sim.scene, &of.target);
            EpisodeError::NoCavity { task: self.task.id, target: of.target.clone(), placed_at }
        })?;
        Ok(Subject::Rests { target, on, region })
    }

    /// The subject for a joint in the range that `range` derives from its limits. A range that includes a limit
    /// is open at it.
    fn joint(&self, name: &str, range: impl Fn([f64; 2]) -> [f64; 2]) -> Result<Subject, EpisodeError> {
        let part = self.index_of("joint", name)?;
        let (task, name) = (self.task.id, name.to_owned());
        let placed_at = placed_at(&self.sim.scene, &name);
        let joint = self.sim.objects[part].part.as_ref().map(|part| &part.joint);
        let Some(joint) = joint.filter(|_| matches!(self.sim.objects[part].body, BodyId::Link(_))) else {
            return Err(EpisodeError::NoJoint { task, name, placed_at });
        };
        let (lower, upper) = (joint.lower, joint.upper);
        let [low, high] = range([lower, upper]);
        if low > upper + Joint::TOLERANCE || high < lower - Joint::TOLERANCE {
            return Err(EpisodeError::JointRange { task, name, lower, upper, placed_at });
        }
        // A joint that presses on its stop is a little beyond its limit.
        let low = if low <= lower + Joint::TOLERANCE { f64::NEG_INFINITY } else { low - Joint::TOLERANCE };
        let high = if high >= upper - Joint::TOLERANCE { f64::INFINITY } else { high + Joint::TOLERANCE };
        Ok(Subject::Joint { part, range: [low, high] })
    }
}

/// True if a goal asks for all of its predicates at once.
fn is_conjunction(goal: &GoalNode) -> bool {
    match goal {
        GoalNode::Predicate(_) => true,
        GoalNode::All(parts) => parts.iter().all(is_conjunction),
        _ => false,
    }
}

/// Knowledge of a goal before its scene has settled.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GoalAtStart {
    /// True if the goal may hold once the scene has settled.
    pub may_hold: bool,
    /// The first step of a sequence, if it holds already.
    pub held_step: Option<String>,
}

/// Checks the goal of a task in a scene that need not have settled.
///
/// # Errors
/// The goal names an unknown object, a container without a cavity or something without a joint, or gravity
/// does not point down.
pub fn check_goal(
    task: &Task,
    sim: &Simulation,
    cache: &AssetCache,
    functions: &[Arc<dyn StatePredicate>],
) -> Result<GoalAtStart, EpisodeError> {
    let goal = GoalInScene::find(task, sim, cache, functions)?;
    // Objects at rest are not known before they have settled.
    let holds = |number| goal.holds(number, sim, 0.0, |_| false).unwrap_or(false);
    let known: Vec<bool> = (0..goal.predicates.len()).map(holds).collect();
    let step = first_step_held(&task.goal, &goal.goal, &known);
    Ok(GoalAtStart { may_hold: goal.may_hold(sim), held_step: step.map(Goal::describe) })
}

/// True if a goal asks for something not to hold, which is not known of objects at rest.
fn is_negated(node: &GoalNode) -> bool {
    match node {
        GoalNode::Predicate(_) => false,
        GoalNode::None(_) => true,
        GoalNode::All(parts) | GoalNode::Any(parts) | GoalNode::Sequence(parts) => {
            parts.iter().any(is_negated)
        }
    }
}

/// The first step of a sequence that nothing comes before, if it holds at the start; `holds` says which predicates do.
fn first_step_held<'a>(goal: &'a Goal, node: &GoalNode, holds: &[bool]) -> Option<&'a Goal> {
    match (goal, node) {
        (Goal::Sequence(goals), GoalNode::Sequence(nodes)) => {
            let (first, node) = (goals.goals.first()?, nodes.first()?);
            match nodes.len() > 1 && !is_negated(node) && GoalMonitor::new(node.clone()).update(holds) {
                true => Some(first),
                false => first_step_held(first, node, holds),
            }
        }
        (Goal::All(goals), GoalNode::All(nodes)) | (Goal::Any(goals), GoalNode::Any(nodes)) => {
            goals.goals.iter().zip(nodes).find_map(|(goal, node)| first_step_held(goal, node, holds))
        }
        _ => None,
    }
}

/// Region in which an object must rest, in the frame of the object that carries it at its foot. `None` for the inside
/// of an object without a cavity.
fn region_of(target: &ObjectInstance, is_inside: bool, cache: &AssetCache) -> Option<GoalRegion> {
    if !is_inside {
        return Some(GoalRegion::On { radius_m: 0.5 * target.bounds.size().xy().min() });
    }
    let Aabb { min, max } = cache.shape(&target.asset.shape).cavity()?;
    let foot = target.foot_o();
    Some(GoalRegion::Inside { space: Aabb { min: min - foot, max: max - foot } })
}
