//! The episodes of a run in order. They are counted and not stored, since `--episodes` can request billions.

use std::collections::BTreeSet;

use softvt_benchmark::Task;
use softvt_common::episode_id::EpisodeIndex;
use softvt_runs::shard::Shard;

#[derive(Clone, Copy, Debug)]
pub struct EpisodeJob<'a> {
    pub task: &'a Task,
    pub episode: u32,
}

impl EpisodeJob<'_> {
    pub fn index(&self) -> EpisodeIndex {
        EpisodeIndex { task: self.task.id, episode: self.episode }
    }
}

/// Episodes in the order in which they run: task by task, ascending. A position in the list counts from 0.
#[derive(Clone, Debug)]
pub struct EpisodeList<'a> {
    tasks: Vec<&'a Task>,
    episodes: Episodes,
    /// Only this part of the episodes.
    shard: Option<Shard>,
    /// Episodes that are left out.
    omitted: BTreeSet<EpisodeIndex>,
}

#[derive(Clone, Debug)]
enum Episodes {
    /// The first ones of each task.
    First(u32),
    Listed(BTreeSet<EpisodeIndex>),
}

impl<'a> EpisodeList<'a> {
    /// Episodes `0..episodes` of each task; with `shard` only those of this part.
    pub fn of_tasks(tasks: &[&'a Task], episodes: u32, shard: Option<Shard>) -> Self {
        let (tasks, episodes) = (tasks.to_vec(), Episodes::First(episodes));
        Self { tasks, episodes, shard, omitted: BTreeSet::new() }
    }

    pub fn listed(jobs: impl IntoIterator<Item = EpisodeJob<'a>>) -> Self {
        let jobs: Vec<EpisodeJob> = jobs.into_iter().collect();
        let mut tasks: Vec<&Task> = jobs.iter().map(|job| job.task).collect();
        tasks.sort_by_key(|task| task.id);
        tasks.dedup_by_key(|task| task.id);
        let episodes = Episodes::Listed(jobs.iter().map(EpisodeJob::index).collect());
        Self { tasks, episodes, shard: None, omitted: BTreeSet::new() }
    }

    /// The tasks of the episodes, those without one in a shard included, in order.
    pub fn tasks(&self) -> Vec<&'a Task> {
        self.tasks.clone()
    }

    pub fn without(&self, done: impl Iterator<Item = EpisodeIndex>) -> Self {
        let mut left = self.clone();
        left.omitted.extend(done.filter(|index| self.find(*index).is_some()));
        left
    }

    pub fn len(&self) -> usize {
        let all = match &self.episodes {
            Episodes::First(count) => self.tasks.len() * *count as usize,
            Episodes::Listed(listed) => listed.len(),
        };
        self.shard.map_or(all, |shard| shard.len(all)) - self.omitted.len()
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The episode at a position.
    ///
    /// # Panics
    /// The position is not below [`EpisodeList::len`].
    pub fn job(&self, position: usize) -> EpisodeJob<'a> {
        self.iter().nth(position).expect("a position in the list")
    }

    pub fn iter(&self) -> impl Iterator<Item = EpisodeJob<'a>> + '_ {
        (0..self.tasks.len()).flat_map(|rank| self.of_rank(rank))
    }

    /// The episode with this index, if the list has it.
    pub fn find(&self, index: EpisodeIndex) -> Option<EpisodeJob<'a>> {
        let rank = self.tasks.iter().position(|task| task.id == index.task)?;
        let is_known = match &self.episodes {
            Episodes::First(count) => index.episode < *count,
            Episodes::Listed(listed) => listed.contains(&index),
        };
        let job = EpisodeJob { task: self.tasks[rank], episode: index.episode };
        (is_known && self.has(rank, index)).then_some(job)
    }

    /// Numbers of the episodes of a task, ascending.
    pub fn episodes_of(&self, task: usize) -> impl Iterator<Item = u32> + '_ {
        let rank = self.tasks.iter().position(|known| known.id == task);
        rank.into_iter().flat_map(|rank| self.of_rank(rank)).map(|job| job.episode)
    }

    /// The episodes of the task with this place among the tasks.
    fn of_rank(&self, rank: usize) -> impl Iterator<Item = EpisodeJob<'a>> + '_ {
        let task = self.tasks[rank];
        let at = |episode: u32| EpisodeIndex { task: task.id, episode };
        let (first, listed) = match &self.episodes {
            Episodes::First(count) => (*count, None),
            Episodes::Listed(listed) => (0, Some(listed.range(at(0)..=at(u32::MAX)))),
        };
        let listed = listed.into_iter().flatten().map(|index| index.episode);
        let all = (0..first).chain(listed).map(at);
        all.filter(move |index| self.has(rank, *index))
            .map(move |index| EpisodeJob { task, episode: index.episode })
    }

    /// True if an episode is of the shard and not left out.
    fn has(&self, rank: usize, index: EpisodeIndex) -> bool {
        let is_in = |shard: Shard| match self.episodes {
            Episodes::First(count) => shard.contains(rank * count as usize + index.episode as usize),
            Episodes::Listed(_) => true,
        };
        self.shard.is_none_or(is_in) && !self.omitted.contains(&index)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use softvt_benchmark::{Goal, Placement};

    fn tasks(count: usize) -> Vec<Task> {
        let goal = Goal::On(Placement { object: "a".to_owned(), target: "b".to_owned(), hold_s: 0.4 });
        let task = |id| Task {
            id,
            prompt_varies: false,
            prompt: "move".to_owned(),
            layout: "one".to_owned(),
            goal: goal.clone(),
            object: "a".to_owned(),
            budget_steps: 1,
            expert: false,
        };
        (0..count).map(task).collect()
    }

    fn pairs(list: &EpisodeList) -> Vec<(usize, u32)> {
        list.iter().map(|job| (job.task.id, job.episode)).collect()
    }

    #[test]
    fn a_list_has_the_episodes_of_all_tasks_in_order() {
        let tasks = tasks(2);
        let tasks: Vec<&Task> = tasks.iter().collect();
        let list = EpisodeList::of_tasks(&tasks, 3, None);
        let all = [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2)];
        assert_eq!(pairs(&list), all);
        let parts: Vec<EpisodeList> = ["1/4", "2/4", "3/4", "4/4"]
            .into_iter()
            .map(|shard| EpisodeList::of_tasks(&tasks, 3, Some(shard.parse().unwrap())))
            .collect();
        assert_eq!(
            parts.iter().map(pairs).collect::<Vec<_>>(),
            [vec![(0, 0), (1, 1)], vec![(0, 1), (1, 2)], vec![(0, 2)], vec![(1, 0)]]
        );
        let index = |(task, episode): (usize, u32)| EpisodeIndex { task, episode };
        for part in &parts {
            let found: Vec<_> = all.into_iter().filter(|at| part.find(index(*at)).is_some()).collect();
            assert_eq!((found.len(), found), (part.len(), pairs(part)));
        }
        assert_eq!(list.episodes_of(1).collect::<Vec<_>>(), [0, 1, 2]);
        assert_eq!(parts[1].episodes_of(1).collect::<Vec<_>>(), [2]);
        assert_eq!(parts[2].episodes_of(1).count(), 0);
    }

    #[test]
    fn finished_episodes_are_left_out() {
        let tasks = tasks(2);
        let tasks: Vec<&Task> = tasks.iter().collect();
        let list = EpisodeList::of_tasks(&tasks, 3, None);
        let done = [(1, 0), (0, 1), (0, 0), (7, 7)].map(|(task, episode)| EpisodeIndex { task, episode });
        let remaining = list.without(done.into_iter());
        assert_eq!(pairs(&remaining), [(0, 2), (1, 1), (1, 2)]);
        assert!(remaining.find(done[0]).is_none() && list.find(done[0]).is_some());
        let jobs: Vec<EpisodeJob> = list.iter().collect();
        assert_eq!(pairs(&EpisodeList::listed(jobs).without(done.into_iter())), pairs(&remaining));
        assert!(list.without(list.iter().map(|job| job.index())).is_empty());
    }

    #[test]
    fn billions_of_episodes_take_no_memory() {
        let tasks = tasks(10);
        let tasks: Vec<&Task> = tasks.iter().collect();
        let list = EpisodeList::of_tasks(&tasks, u32::MAX, None);
        assert_eq!(list.len(), 10 * u32::MAX as usize);
        assert_eq!((list.job(7).episode, list.episodes_of(9).next()), (7, Some(0)));
        let last = EpisodeIndex { task: 9, episode: u32::MAX - 1 };
        let shorter = list.without(std::iter::once(last));
        assert!(list.find(last).is_some() && shorter.find(last).is_none());
        assert_eq!(shorter.len(), list.len() - 1);
    }
}
