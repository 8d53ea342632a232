//! Goals of tasks: predicates of the true scene, and their combinations.

use mlua::{Function, Lua, Table, Value};

use super::pose::ANGLES;
use crate::schema::{
    HasTable, LuaType, Range, Record, RecordType, Type, Unchecked, choice, functions, invalid, make, one_of,
    record,
};
use softvt_benchmark::{
    Placement,
    goal::{Goal, Side, SubGoals},
};

choice! {
    Side {
        "left_of" => LeftOf,
        "right_of" => RightOf,
        "in_front_of" => InFrontOf,
        "behind" => Behind,
    }
}

const HOLD: Type = Type::Number("s", Range::closed(0.0, 10.0));
const SHARE: Type = Type::Number("", Range::closed(0.0, 1.0));
/// Largest distance of two objects in a goal, m: about that of the ends of the workspace.
const MAX_DISTANCE: f64 = 1.5;
/// Smallest distance of an object on a side of another.
const BEYOND: Type = Type::Number("m", Range::closed(0.0, MAX_DISTANCE));
/// Distance within which an object is near another. No two centres are nearer than a millimetre for long.
const WITHIN: Type = Type::Number("m", Range::closed(1e-3, MAX_DISTANCE));
/// Type of the parts of a combination. It names no constructors, since those of combinations would name themselves; the
/// functions that make combinations check their arguments.
const GOALS: Type = Type::List(&Type::Table("softvt.Goal"));
const PARTS: Type = Type::List(<GoalSpec as LuaType>::REFERENCE);

record! {
    /// The object rests on the target, released, for a time.
    OnSpec: "softvt.On" as "task.goal", constructor "softvt.on" {
        /// Scene name of the object.
        object: String;
        /// Scene name of the target, or of a part of it (cabinet.top_drawer).
        target: String;
        /// Time that it must stay there.
        hold_s: f64 = HOLD => Number(0.4);
    }
    /// The object rests in the target's cavity, carried by it or by objects in it, released, for a time. The cavity is
    /// the space in which its shape holds water.
    InsideSpec: "softvt.Inside" as "task.goal", constructor "softvt.inside" {
        /// Scene name of the object.
        object: String;
        /// Scene name of the target, or of a part of it (cabinet.top_drawer).
        target: String;
        /// Time that it must stay there.
        hold_s: f64 = HOLD => Number(0.4);
    }
    /// Each object rests on the one before it in the list, released, for a time.
    StackedSpec: "softvt.Stacked" as "task.goal", constructor "softvt.stacked" {
        /// Scene names, from the lowest object on; at least two.
        objects: Vec<String> = Type::Distinct { of: &Type::Text, by: "", min: 2 };
        /// Time that they must stay there.
        hold_s: f64 = HOLD => Number(0.4);
    }
    /// A joint is open.
    OpenedSpec: "softvt.Opened" as "task.goal", constructor "softvt.opened" {
        /// Part of an articulated object (cabinet.top_drawer).
        joint: String;
        /// Smallest share of its range, from the lowest value on.
        share: f64 = SHARE => Number(0.7);
    }
    /// A joint is closed.
    ClosedSpec: "softvt.Closed" as "task.goal", constructor "softvt.closed" {
        /// Part of an articulated object (cabinet.top_drawer).
        joint: String;
        /// Largest share of its range, from the lowest value on.
        share: f64 = SHARE => Number(0.1);
    }
    /// The value of a joint is within a range.
    TurnedSpec: "softvt.Turned" as "task.goal", constructor "softvt.turned" {
        /// Part of an articulated object (stove.knob).
        joint: String;
        /// Lowest and highest value, rad of a hinge and m of a slider.
        range: [f64; 2] = Type::Interval("rad or m", ANGLES);
    }
    /// The centres of two objects are near each other in the horizontal plane, and the robot does not touch the
    /// object, for a time.
    NearSpec: "softvt.Near" as "task.goal", constructor "softvt.near" {
        /// Scene name of the object.
        object: String;
        /// Scene name of the target, or of a part of it.
        target: String;
        /// Largest distance of the centres.
        distance: f64 = WITHIN => Number(0.15);
        /// Time that it must stay there.
        hold_s: f64 = HOLD => Number(0.4);
    }
    /// The object is beside the target, within 45° of a direction of the robot's base, and the robot does not touch
    /// it, for a time.
    BesideSpec: "softvt.Beside" as "task.goal", constructor "softvt.beside" {
        /// Side of the target: "left_of" (+y of the base), "right_of", "in_front_of" (nearer to the robot, −x) or
        /// "behind".
        side: Side;
        /// Scene name of the object.
        object: String;
        /// Scene name of the target, or of a part of it.
        target: String;
        /// Smallest distance of the centres in that direction.
        distance: f64 = BEYOND => Number(0.05);
        /// Time that it must stay there.
        hold_s: f64 = HOLD => Number(0.4);
    }
    /// The z axis of the object is upright, and the robot does not touch the object, for a time.
    UprightSpec: "softvt.Upright" as "task.goal", constructor "softvt.upright" {
        /// Scene name of the object.
        object: String;
        /// Largest angle between the axis and the vertical.
        angle: f64 = Type::Number("rad", Range::closed(0.0, 3.1)) => Number(0.17);
        /// Time that it must stay so.
        hold_s: f64 = HOLD => Number(0.4);
    }
    /// A function of the true scene returns true at the end of a control step. It must depend on its argument alone:
    /// variables that it changes are not part of the state of an episode.
    PredicateSpec: "softvt.Predicate" as "task.goal", constructor "softvt.predicate" {
        /// Condition in words, for records and reports.
        name: String;
        /// Returns true if the condition holds.
        holds: Function = Type::Function("fun(scene: softvt.SceneState): boolean");
    }
    /// All of these goals hold at once.
    AllSpec: "softvt.All" as "task.goal", constructor "softvt.all" {
        /// Goals that must hold.
        goals: Vec<Table> = GOALS;
    }
    /// At least one of these goals holds.
    AnySpec: "softvt.Any" as "task.goal", constructor "softvt.any" {
        /// Goals of which one must hold.
        goals: Vec<Table> = GOALS;
    }
    /// None of these goals holds.
    NoneSpec: "softvt.None" as "task.goal", constructor "softvt.none" {
        /// Goals that must not hold.
        goals: Vec<Table> = GOALS;
    }
    /// Each of these goals has held once after the one before it had, and the last one holds.
    SequenceSpec: "softvt.Sequence" as "task.goal", constructor "softvt.sequence" {
        /// The goals, in order.
        goals: Vec<Table> = GOALS;
    }
}

one_of! {
    /// The goal of a task.
    GoalSpec {
        On(OnSpec),
        Inside(InsideSpec),
        Stacked(StackedSpec),
        Opened(OpenedSpec),
        Closed(ClosedSpec),
        Turned(TurnedSpec),
        Near(NearSpec),
        Beside(BesideSpec),
        Upright(UprightSpec),
        Predicate(PredicateSpec),
        All(AllSpec),
        Any(AnySpec),
        None(NoneSpec),
        Sequence(SequenceSpec),
    }
}

/// Constructors of goals that are tables with named fields: all but the combinations, which come last.
pub(crate) static CONSTRUCTORS: &[&Record] = GoalSpec::RECORDS.split_at(GoalSpec::RECORDS.len() - 4).0;

functions! {
    FUNCTIONS {
        /// Returns a goal that holds while all of these do: `softvt.all { softvt.opened {…}, softvt.on {…} }`.
        fn all(lua, goals: Table = PARTS) -> ["softvt.All"] { combine(lua, AllSpec::RECORD, "all", &goals)? }
        /// Returns a goal that holds while at least one of these does.
        fn any(lua, goals: Table = PARTS) -> ["softvt.Any"] { combine(lua, AnySpec::RECORD, "any", &goals)? }
        /// Returns a goal that holds while none of these does.
        fn none(lua, goals: Table = PARTS) -> ["softvt.None"] { combine(lua, NoneSpec::RECORD, "none", &goals)? }
        /// Returns a goal that holds while the last of these does, once each of the others has held, in this order.
        fn sequence(lua, goals: Table = PARTS) -> ["softvt.Sequence"] {
            combine(lua, SequenceSpec::RECORD, "sequence", &goals)?
        }
        /// softvt.beside with side = "left_of".
        fn left_of(lua, of: Unchecked = BESIDE) -> ["softvt.Beside"] { beside(lua, "left_of", &of.0)? }
        /// softvt.beside with side = "right_of".
        fn right_of(lua, of: Unchecked = BESIDE) -> ["softvt.Beside"] { beside(lua, "right_of", &of.0)? }
        /// softvt.beside with side = "in_front_of".
        fn in_front_of(lua, of: Unchecked = BESIDE) -> ["softvt.Beside"] { beside(lua, "in_front_of", &of.0)? }
        /// softvt.beside with side = "behind".
        fn behind(lua, of: Unchecked = BESIDE) -> ["softvt.Beside"] { beside(lua, "behind", &of.0)? }
    }
}

/// Type of the argument of `left_of` and of the like.
const BESIDE: Type = Type::Table("{ object: string, target: string, distance: number?, hold_s: number? }");

/// Makes the goal of a side from the other fields.
fn beside(lua: &Lua, side: &str, of: &Value) -> mlua::Result<Table> {
    let Value::Table(of) = of else {
        bail!(lua, "{side}: expected a table; write softvt.{side} {{ object = …, target = … }}");
    };
    if !of.raw_get::<Value>("side")?.is_nil() {
        let message = format!("softvt.{side} is this side already; leave side out, or write softvt.beside");
        return Err(invalid(lua, BesideSpec::RECORD.label, "side", message));
    }
    let table = lua.create_table()?;
    for entry in of.pairs::<Value, Value>() {
        let (key, value) = entry?;
        table.set(key, value)?;
    }
    table.set("side", side)?;
    make(lua, BesideSpec::RECORD, &Value::Table(table))
}

const MAX_DEPTH: usize = 8;
const MAX_PREDICATES: usize = 64;

fn combine(lua: &Lua, record: &'static Record, name: &str, goals: &Table) -> mlua::Result<Table> {
    if goals.raw_len() == 0 {
        bail!(lua, "{name}: expected at least one goal; write softvt.{name} {{ a, b }}");
    }
    let table = lua.create_table()?;
    table.set("goals", goals)?;
    make(lua, record, &Value::Table(table))
}

/// A predicate with the place in which a script declares it.
pub(crate) struct DeclaredPredicate {
    pub goal: Goal,
    pub table: Table,
    /// Its function, if it is [`Goal::Predicate`].
    pub function: Option<Function>,
    /// True if it is one of several of a `softvt.stacked`.
    pub is_stacked: bool,
}

impl DeclaredPredicate {
    /// The field of its table that names `field`, "object" or "target": both are in the list of `softvt.stacked`.
    pub(crate) fn field(&self, field: &'static str) -> &'static str {
        if self.is_stacked { "objects" } else { field }
    }
}

impl GoalSpec {
    /// The goal as plain data, and its predicates in order.
    pub(crate) fn plain(&self, lua: &Lua) -> mlua::Result<(Goal, Vec<DeclaredPredicate>)> {
        let mut predicates = Vec::new();
        let goal = self.convert(lua, 0, &mut predicates)?;
        if predicates.len() > MAX_PREDICATES {
            bail!(lua, "task.goal: has {} predicates; give at most {MAX_PREDICATES}", predicates.len());
        }
        Ok((goal, predicates))
    }

    fn convert(
        &self,
        lua: &Lua,
        depth: usize,
        predicates: &mut Vec<DeclaredPredicate>,
    ) -> mlua::Result<Goal> {
        if depth > MAX_DEPTH {
            bail!(lua, "task.goal: goals are nested more than {MAX_DEPTH} deep");
        }
        let (goals, combined): (&[Table], fn(SubGoals) -> Goal) = match self {
            Self::All(spec) => (&spec.goals, Goal::All),
            Self::Any(spec) => (&spec.goals, Goal::Any),
            Self::None(spec) => (&spec.goals, Goal::None),
            Self::Sequence(spec) => (&spec.goals, Goal::Sequence),
            predicate => return Ok(predicate.declare(predicates)),
        };
        let goal = |goal: &Table| {
            Self::from_checked(Value::Table(goal.clone()), lua)?.convert(lua, depth + 1, predicates)
        };
        Ok(combined(SubGoals { goals: goals.iter().map(goal).collect::<mlua::Result<_>>()? }))
    }

    /// A predicate as plain data; an empty conjunction for a combination.
    fn declare(&self, predicates: &mut Vec<DeclaredPredicate>) -> Goal {
        let mut declared = |goal: Goal| {
            predicates.push(DeclaredPredicate {
                goal: goal.clone(),
                table: self.table().clone(),
                function: if let Self::Predicate(goal) = self { Some(goal.holds.clone()) } else { None },
                is_stacked: matches!(self, Self::Stacked(_)),
            });
            goal
        };
        let goal = match self {
            Self::On(goal) => Goal::On(placement(&goal.object, &goal.target, goal.hold_s)),
            Self::Inside(goal) => Goal::Inside(placement(&goal.object, &goal.target, goal.hold_s)),
            Self::Opened(goal) => Goal::Opened { joint: goal.joint.clone(), share: goal.share },
            Self::Closed(goal) => Goal::Closed { joint: goal.joint.clone(), share: goal.share },
            Self::Turned(goal) => Goal::Turned { joint: goal.joint.clone(), range: goal.range },
            Self::Near(goal) => Goal::Near {
                of: placement(&goal.object, &goal.target, goal.hold_s),
                distance_m: goal.distance,
            },
            Self::Beside(goal) => Goal::Beside {
                side: goal.side,
                of: placement(&goal.object, &goal.target, goal.hold_s),
                distance_m: goal.distance,
            },
            Self::Upright(goal) => {
                Goal::Upright { object: goal.object.clone(), hold_s: goal.hold_s, angle_rad: goal.angle }
            }
            Self::Predicate(goal) => Goal::Predicate { name: goal.name.clone() },
            Self::Stacked(spec) => {
                let on = |pair: &[String]| declared(Goal::On(placement(&pair[1], &pair[0], spec.hold_s)));
                return Goal::All(SubGoals { goals: spec.objects.windows(2).map(on).collect() });
            }
            Self::All(_) | Self::Any(_) | Self::None(_) | Self::Sequence(_) => {
                return Goal::All(SubGoals { goals: Vec::new() });
            }
        };
        declared(goal)
    }
}

fn placement(object: &str, target: &str, hold_s: f64) -> Placement {
    Placement { object: object.to_owned(), target: target.to_owned(), hold_s }
}
