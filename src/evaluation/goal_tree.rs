//! Goals of several parts: predicates, combined by all, any, none and sequence.

/// A goal: which of its predicates must hold, and in which order. Predicates have numbers.
#[derive(Clone, Debug, PartialEq)]
pub enum GoalNode {
    /// The predicate of this number holds.
    Predicate(usize),
    /// All of these hold at once.
    All(Vec<Self>),
    /// At least one of these holds.
    Any(Vec<Self>),
    /// None of these holds.
    None(Vec<Self>),
    /// Each of these has held once after the one before it had; the last one holds.
    Sequence(Vec<Self>),
}

impl GoalNode {
    /// Calls `visit` with the number of each predicate that must hold at the end, in order: those that are not negated,
    /// optional, or an earlier step of a sequence.
    pub fn for_each_final(&self, visit: &mut impl FnMut(usize)) {
        match self {
            Self::Predicate(number) => visit(*number),
            Self::All(parts) => parts.iter().for_each(|part| part.for_each_final(visit)),
            Self::Sequence(parts) => {
                parts.iter().last().into_iter().for_each(|part| part.for_each_final(visit))
            }
            Self::Any(_) | Self::None(_) => {}
        }
    }

    /// Calls `visit` with the number of each predicate that must not hold: those under an odd number of `None`, without
    /// the earlier steps of sequences.
    pub fn for_each_negated(&self, visit: &mut impl FnMut(usize)) {
        self.walk_negated(false, visit);
    }

    fn walk_negated(&self, is_negated: bool, visit: &mut impl FnMut(usize)) {
        match self {
            Self::Predicate(number) if is_negated => visit(*number),
            Self::Predicate(_) => {}
            Self::None(parts) => parts.iter().for_each(|part| part.walk_negated(!is_negated, visit)),
            Self::All(parts) | Self::Any(parts) => {
                parts.iter().for_each(|part| part.walk_negated(is_negated, visit));
            }
            Self::Sequence(parts) => {
                // The earlier steps have to hold once, whatever is asked of the whole.
                let last = parts.len().saturating_sub(1);
                parts
                    .iter()
                    .enumerate()
                    .for_each(|(at, part)| part.walk_negated(is_negated && at == last, visit));
            }
        }
    }

    fn sequences(&self) -> usize {
        match self {
            Self::Predicate(_) => 0,
            Self::All(parts) | Self::Any(parts) | Self::None(parts) => {
                parts.iter().map(Self::sequences).sum()
            }
            Self::Sequence(parts) => 1 + parts.iter().map(Self::sequences).sum::<usize>(),
        }
    }
}

/// Evaluates a goal at every control step.
#[derive(Clone, Debug, PartialEq)]
pub struct GoalMonitor {
    goal: GoalNode,
    /// Steps done of each sequence, in the order of a depth-first walk.
    done: Vec<usize>,
}

impl GoalMonitor {
    /// Monitor of a goal of which nothing has happened yet.
    pub fn new(goal: GoalNode) -> Self {
        Self { done: vec![0; goal.sequences()], goal }
    }

    /// Takes in which predicates hold at a control step. Returns true if the goal holds.
    pub fn update(&mut self, holds: &[bool]) -> bool {
        let mut walk = Walk { holds, done: &mut self.done, sequence: 0 };
        walk.evaluate(&self.goal, true)
    }
}

struct Walk<'a> {
    holds: &'a [bool],
    done: &'a mut [usize],
    /// Number of the next sequence.
    sequence: usize,
}

impl Walk<'_> {
    /// True if `node` holds. Sequences proceed only if `is_turn`: if the sequences around them have come to them. All
    /// parts are visited, since sequences are numbered by the walk.
    fn evaluate(&mut self, node: &GoalNode, is_turn: bool) -> bool {
        match node {
            GoalNode::Predicate(number) => self.holds[*number],
            GoalNode::All(parts) => parts.iter().fold(true, |all, part| self.evaluate(part, is_turn) & all),
            GoalNode::Any(parts) => parts.iter().fold(false, |any, part| self.evaluate(part, is_turn) | any),
            GoalNode::None(parts) => {
                parts.iter().fold(true, |none, part| !self.evaluate(part, is_turn) & none)
            }
            GoalNode::Sequence(parts) => {
                let own = self.sequence;
                self.sequence += 1;
                let (last, mut holds) = (parts.len().saturating_sub(1), parts.is_empty());
                for (place, part) in parts.iter().enumerate() {
                    let is_next = is_turn && self.done[own] == place;
                    holds = self.evaluate(part, is_next);
                    if is_next && holds && place < last {
                        self.done[own] += 1;
                    }
                }
                holds && self.done[own] == last
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use GoalNode::{All, Any, None, Predicate, Sequence};

    /// True for each control step after which the goal holds; the letters of a step are the predicates that hold.
    fn run(goal: &GoalNode, steps: &[&str]) -> Vec<bool> {
        let mut monitor = GoalMonitor::new(goal.clone());
        let holds = |step: &str| "abcd".chars().map(|name| step.contains(name)).collect::<Vec<_>>();
        steps.iter().map(|step| monitor.update(&holds(step))).collect()
    }

    fn two() -> Vec<GoalNode> {
        vec![Predicate(0), Predicate(1)]
    }

    #[test]
    fn all_any_and_none_are_of_the_same_moment() {
        let steps = ["", "a", "b", "ab"];
        assert_eq!(run(&All(two()), &steps), [false, false, false, true]);
        assert_eq!(run(&Any(two()), &steps), [false, true, true, true]);
        assert_eq!(run(&None(two()), &steps), [true, false, false, false]);
        let nested = All(vec![Predicate(0), None(vec![Predicate(1)])]);
        assert_eq!(run(&nested, &steps), [false, true, false, false]);
    }

    #[test]
    fn a_sequence_keeps_what_was_done_and_asks_for_the_last_part_at_the_end() {
        let goal = Sequence(vec![Predicate(0), Predicate(1), Predicate(2)]);
        assert_eq!(
            run(&goal, &["c", "bc", "a", "b", "", "c", "", "c"])[3..],
            [false, false, true, false, true]
        );
        assert_eq!(run(&goal, &["c", "b", "a", "c"]), [false; 4], "in the wrong order");
        assert_eq!(run(&goal, &["abc"]), [true], "all at once");
        assert_eq!(run(&Sequence(vec![Predicate(0)]), &["", "a"]), [false, true]);
    }

    #[test]
    fn a_sequence_within_another_begins_when_its_turn_has_come() {
        let inner = Sequence(vec![Predicate(1), Predicate(2)]);
        let goal = Sequence(vec![Predicate(0), inner]);
        assert_eq!(run(&goal, &["b", "a", "c"]), [false; 3], "b came before a");
        assert_eq!(run(&goal, &["a", "b", "c"]), [false, false, true]);
        let side_by_side =
            All(vec![Sequence(vec![Predicate(0), Predicate(1)]), Sequence(vec![Predicate(2), Predicate(3)])]);
        assert_eq!(run(&side_by_side, &["c", "a", "bd"]), [false, false, true]);
    }

    #[test]
    fn what_must_hold_at_the_end_is_not_an_earlier_step_nor_negated_nor_optional() {
        let goal = All(vec![
            Predicate(0),
            Sequence(vec![Predicate(1), Predicate(2)]),
            Any(vec![Predicate(3)]),
            None(vec![Predicate(4)]),
        ]);
        let mut numbers = Vec::new();
        goal.for_each_final(&mut |number| numbers.push(number));
        assert_eq!(numbers, [0, 2]);
        let mut negated = Vec::new();
        goal.for_each_negated(&mut |number| negated.push(number));
        None(vec![None(vec![Predicate(5)])]).for_each_negated(&mut |number| negated.push(number));
        None(vec![Sequence(vec![Predicate(6), Predicate(7)])])
            .for_each_negated(&mut |number| negated.push(number));
        assert_eq!(negated, [4, 7], "the first step has to hold once");
    }
}
