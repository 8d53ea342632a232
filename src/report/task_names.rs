//! Short names of tasks in tables.

/// Fields from which a task gets its name in a table.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TaskName<'a> {
    pub prompt: &'a str,
    pub asset: &'a str,
}

/// Short names of tasks: their asset, and where several tasks have it, the parts in which their prompts differ.
pub(crate) fn task_names(tasks: &[TaskName]) -> Vec<String> {
    let name = |task: &TaskName| {
        let object = object_name(task.asset);
        let same: Vec<&str> =
            tasks.iter().filter(|other| other.asset == task.asset).map(|other| other.prompt).collect();
        let own = same.iter().position(|prompt| *prompt == task.prompt).unwrap_or(0);
        match distinct_parts(&same).get(own) {
            Some(part) if same.len() > 1 && *part != task.prompt => format!("{object}, {part}"),
            _ => object,
        }
    };
    tasks.iter().map(name).collect()
}

pub(crate) fn object_name(asset: &str) -> String {
    asset.replace('_', " ")
}

/// The prompts without the whole words with which all of them begin or end.
fn distinct_parts<'a>(prompts: &[&'a str]) -> Vec<&'a str> {
    let words: Vec<Vec<&str>> = prompts.iter().map(|p| p.split(' ').collect()).collect();
    let Some(shortest) = words.iter().map(Vec::len).min() else { return Vec::new() };
    if words.iter().all(|w| *w == words[0]) {
        return prompts.to_vec();
    }
    let same = |at: &dyn Fn(&[&'a str]) -> &'a str| words.iter().all(|w| at(w) == at(&words[0]));
    let head = (0..shortest - 1).take_while(|i| same(&|w| w[*i])).count();
    let tail = (1..shortest - head).take_while(|i| same(&|w| w[w.len() - *i])).count();
    let length = |words: &[&str]| words.iter().map(|word| word.len() + 1).sum::<usize>();
    let cut = |prompt: &'a str, w: &[&str]| {
        &prompt[length(&w[..head])..prompt.len() - length(&w[w.len() - tail..])]
    };
    prompts.iter().zip(&words).map(|(prompt, w)| cut(prompt, w)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tasks_have_the_name_of_their_object_and_what_differs() {
        let task = |prompt, asset| TaskName { prompt, asset };
        let tasks = [
            task("lift a roll", "steamed_bun"),
            task("lift the left pastry", "croissant"),
            task("lift the right pastry", "croissant"),
        ];
        assert_eq!(task_names(&tasks), ["steamed bun", "croissant, left", "croissant, right"]);
        assert_eq!(task_names(&[task("lift it", "bun"), task("lift it", "bun")]), ["bun", "bun"]);
    }

    #[test]
    fn prompts_are_reduced_to_their_distinct_parts() {
        assert_eq!(distinct_parts(&["put a on it", "put b c on it"]), ["a", "b c"]);
        assert_eq!(distinct_parts(&["same", "same"]), ["same", "same"]);
        assert_eq!(distinct_parts(&["put it", "put it down"]), ["it", "it down"]);
        assert_eq!(distinct_parts(&["étoile à gauche", "étoile à droite"]), ["gauche", "droite"]);
        assert!(distinct_parts(&[]).is_empty());
    }
}
