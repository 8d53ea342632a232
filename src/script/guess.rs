//! What the writer of an unknown name most likely meant.

/// How near a candidate is to a word, the nearest first: whether it is misspelt, cut short or has something added, the
/// number of edits, the length.
type Rank = (u8, usize, usize);

/// The candidate that the writer of `word` most likely meant, if any is close. A name with a dot is that of a part
/// (`chest.top_drawer`): both sides of it may be wrong.
pub fn closest<'a>(word: &str, candidates: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let ranked = candidates.filter_map(|candidate| Some((rank(word, candidate)?, candidate)));
    ranked.min_by_key(|(rank, _)| *rank).map(|(_, candidate)| candidate)
}

fn rank(word: &str, candidate: &str) -> Option<Rank> {
    match (word.split_once('.'), candidate.split_once('.')) {
        (Some((object, part)), Some((known_object, known_part))) => {
            let sides = rank_of_word(object, known_object).zip(rank_of_word(part, known_part));
            let of_sides = sides.map(|(a, b)| (a.0.max(b.0), a.1 + b.1, candidate.len()));
            // An object that is right makes up for a part that is not.
            of_sides.or_else(|| rank_of_word(word, candidate))
        }
        // The part alone, its object forgotten.
        (None, Some((_, known_part))) => {
            rank_of_word(word, candidate).or_else(|| rank_of_word(word, known_part))
        }
        _ => rank_of_word(word, candidate),
    }
}

fn rank_of_word(word: &str, candidate: &str) -> Option<Rank> {
    let edits = strsim::damerau_levenshtein(word, candidate);
    let allowed = (word.chars().count() / 3).max(1);
    let rank = |class| Some((class, edits, candidate.len()));
    match () {
        () if edits <= allowed => rank(0),
        () if word.len() > 2 && candidate.starts_with(word) => rank(1),
        () if candidate.len() > 2 && word.starts_with(candidate) => rank(2),
        () => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_is_found_by_the_start_of_its_name_its_own_name_or_a_misspelt_one() {
        let known = ["c", "lid", "c.top_drawer", "c.middle_drawer", "chest.top_drawer"];
        for (word, meant) in [
            ("c.top", Some("c.top_drawer")),
            ("c.topdrawer", Some("c.top_drawer")),
            ("chset.top", Some("chest.top_drawer")),
            ("middle_drawer", Some("c.middle_drawer")),
            ("lidd", Some("lid")),
            ("lids", Some("lid")),
            ("c.handle", None),
            ("xyz", None),
        ] {
            assert_eq!(closest(word, known.into_iter()), meant, "{word}");
        }
    }
}
