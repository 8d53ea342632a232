//! The episodes of a run in order. They are counted and not stored, since `--episodes` can request billions.

use std::ops::Range;

use softvt_benchmark::Task;
use softvt_common::episode_id::EpisodeIndex;

use softvt_runs::shard::Shard;

/// An episode to run.
#[derive(Clone, Copy, Debug)]
pub struct EpisodeJob<'a> {
    /// Its task.
    pub task: &'a Task,
    /// Its index in the task.
    pub episode: u32,
}

impl EpisodeJob<'_> {
    /// Task and episode.
    pub fn index(&self) -> EpisodeIndex {
        EpisodeIndex { task: self.task.id, episode: self.episode }
    }
}

/// Episodes in the order in which they run. A position in the list counts from 0.
#[derive(Clone, Debug)]
pub struct EpisodeList<'a> {
    all: Episodes<'a>,
    /// Positions that are left out, ascending.
    omitted: Vec<usize>,
}

#[derive(Clone, Debug)]
enum Episodes<'a> {
    /// Episodes `0..episodes` of each task, or those of a shard.
    Range {
        tasks: Vec<&'a Task>,
        episodes: u32,
        shard: Option<Shard>,
    },
    Listed(Vec<EpisodeJob<'a>>),
}

impl<'a> EpisodeList<'a> {
    /// Episodes `0..episodes` of each task, task by task; with `shard` only those of this part.
    pub fn of_tasks(tasks: &[&'a Task], episodes: u32, shard: Option<Shard>) -> Self {
        Self { all: Episodes::Range { tasks: tasks.to_vec(), episodes, shard }, omitted: Vec::new() }
    }

    /// These episodes.
    pub fn listed(jobs: Vec<EpisodeJob<'a>>) -> Self {
        Self { all: Episodes::Listed(jobs), omitted: Vec::new() }
    }

    /// The tasks of the episodes, those without one in a shard included, in order.
    pub fn tasks(&self) -> Vec<&'a Task> {
        match &self.all {
            Episodes::Range { tasks, .. } => tasks.clone(),
            Episodes::Listed(jobs) => {
                let mut tasks: Vec<&Task> = Vec::new();
                for job in jobs {
                    if tasks.iter().all(|task| task.id != job.task.id) {
                        tasks.push(job.task);
                    }
                }
                tasks
            }
        }
    }

    /// The list without these episodes.
    pub fn without(&self, done: impl Iterator<Item = EpisodeIndex>) -> Self {
        let mut omitted: Vec<usize> = done.filter_map(|index| self.all.position(index)).collect();
        omitted.extend(&self.omitted);
        omitted.sort_unstable();
        omitted.dedup();
        Self { all: self.all.clone(), omitted }
    }

    /// Number of episodes.
    pub fn len(&self) -> usize {
        self.all.len() - self.omitted.len()
    }

    /// True if no episode is left.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The episode at a position below [`EpisodeList::len`].
    pub fn job(&self, position: usize) -> EpisodeJob<'a> {
        // The k-th omitted position has k before it, so the number of remaining ones before it does not decrease with
        // k.
        let mut before = (0, self.omitted.len());
        while before.0 < before.1 {
            let middle = before.0.midpoint(before.1);
            match self.omitted[middle] - middle <= position {
                true => before.0 = middle + 1,
                false => before.1 = middle,
            }
        }
        self.all.job(position + before.0)
    }

    /// The episodes in order.
    pub fn iter(&self) -> impl Iterator<Item = EpisodeJob<'a>> + '_ {
        (0..self.len()).map(|position| self.job(position))
    }

    /// The episode with this index, if the list has it.
    pub fn find(&self, index: EpisodeIndex) -> Option<EpisodeJob<'a>> {
        let position = self.all.position(index)?;
        self.omitted.binary_search(&position).is_err().then(|| self.all.job(position))
    }

    /// Numbers of the episodes of a task, ascending.
    pub fn episodes_of(&self, task: usize) -> impl Iterator<Item = u32> + '_ {
        let positions =
            self.all.positions_of(task).filter(|position| self.omitted.binary_search(position).is_err());
        let jobs = positions.map(|position| self.all.job(position));
        jobs.filter(move |job| job.task.id == task).map(|job| job.episode)
    }
}

impl<'a> Episodes<'a> {
    fn len(&self) -> usize {
        match self {
            Self::Range { tasks, episodes, shard } => {
                let all = tasks.len() * *episodes as usize;
                shard.map_or(all, |shard| shard.len(all))
            }
            Self::Listed(jobs) => jobs.len(),
        }
    }

    fn job(&self, position: usize) -> EpisodeJob<'a> {
        match self {
            Self::Range { tasks, episodes, shard } => {
                let number = shard.map_or(position, |shard| shard.number(position));
                let episodes = *episodes as usize;
                EpisodeJob { task: tasks[number / episodes], episode: (number % episodes) as u32 }
            }
            Self::Listed(jobs) => jobs[position],
        }
    }

    /// Positions that include all of a task.
    fn positions_of(&self, task: usize) -> Range<usize> {
        match self {
            Self::Range { tasks, episodes, shard } => {
                let Some(rank) = tasks.iter().position(|known| known.id == task) else { return 0..0 };
                let [first, end] = [rank, rank + 1].map(|rank| rank * *episodes as usize);
                shard.map_or(first..end, |shard| shard.len(first)..shard.len(end))
            }
            Self::Listed(jobs) => 0..jobs.len(),
        }
    }

    fn position(&self, index: EpisodeIndex) -> Option<usize> {
        match self {
            Self::Range { tasks, episodes, shard } => {
                let task = tasks.iter().position(|task| task.id == index.task)?;
                let number = task * *episodes as usize + index.episode as usize;
                let is_listed = index.episode < *episodes && shard.is_none_or(|shard| shard.contains(number));
                is_listed.then(|| shard.map_or(number, |shard| shard.position(number)))
            }
            Self::Listed(jobs) => jobs.iter().position(|job| job.index() == index),
        }
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
        for part in &parts {
            assert!(
                part.iter().all(|job| part.find(job.index()).is_some_and(|own| own.index() == job.index()))
            );
            assert_eq!(
                all.iter()
                    .filter(|(task, episode)| part
                        .find(EpisodeIndex { task: *task, episode: *episode })
                        .is_some())
                    .count(),
                part.len()
            );
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
        let last = EpisodeIndex { task: 9, episode: u32::MAX - 1 };
        assert_eq!(list.job(list.len() - 1).index(), last);
        assert_eq!(list.episodes_of(9).next(), Some(0));
        let shorter = list.without(std::iter::once(last));
        assert_eq!(shorter.job(shorter.len() - 1).episode, u32::MAX - 2);
    }
}
