use crate::sample_record;
use std::{collections::BTreeMap, fs};

use super::*;
use crate::run_summary::{
    summarize_runs,
    tests::{shift, stored},
};
use softvt_evaluation::verdict::{Outcome, TargetVerdict};
use softvt_media::palette::{Colour, DROPPED, FAINT, OVER_LIMIT, SAFE};
use softvt_policy::profile::Profile;
use softvt_runs::{record::EpisodeRecord, stored_run::StoredRun};

const HOSTILE: &str = "<script>alert('x')</script>\"&lt; | \\input{x}";

/// `count` soft episodes, every second of which exceeds its threshold.
fn episodes(suite: &str, count: u32) -> Vec<EpisodeRecord> {
    (0..count)
        .map(|i| {
            let mut record = sample_record();
            (record.header.id.suite, record.header.id.episode) = (suite.into(), i);
            if i % 2 == 1 {
                (record.verdict.safety, record.verdict.object_mut().d_peak) = (false, Some(1.5));
                record.verdict.object_mut().deformation_ok = Some(false);
            }
            record
        })
        .collect()
}

fn render(runs: Vec<StoredRun>) -> String {
    page(&summarize_runs(runs), &Thumbnails::new(), Path::new("."))
}

/// Elements that are opened must be closed in order; of attributes, none may come from a name.
fn assert_well_formed(page: &str) {
    const VOID: [&str; 5] = ["meta", "br", "wbr", "img", "input"];
    let mut open: Vec<&str> = Vec::new();
    for part in page.split('<').skip(1) {
        let (tag, _) = part.split_once('>').expect("a tag ends");
        let name = tag.split_whitespace().next().expect("a name");
        match name.strip_prefix('/') {
            Some(name) => assert_eq!(open.pop(), Some(name)),
            None if name.starts_with('!') || VOID.contains(&name) => {}
            None => {
                assert!(!["script", "link", "iframe", "object"].contains(&name), "{tag}");
                open.push(name);
            }
        }
        let events = ["onload", "onerror", "onclick"];
        assert!(!tag.split_whitespace().any(|word| events.iter().any(|e| word.starts_with(e))), "{tag}");
    }
    assert!(open.is_empty(), "{open:?}");
}

#[test]
fn hostile_names_and_control_characters_are_escaped() {
    let mut records = episodes(HOSTILE, 4);
    for record in &mut records {
        (record.header.prompt, record.header.asset) = (HOSTILE.into(), "bun\u{1b}[2J's".into());
        record.stats.gave_up = Some(HOSTILE.into());
    }
    let mut run = stored("/nowhere/it's <b>\u{1b}[31m", HOSTILE, records);
    run.manifest.arguments.extend([format!("--name={HOSTILE}"), "--asset=bun\u{1b}[2J's".to_owned()]);
    run.manifest.shifts.push(shift(HOSTILE, 2.0));
    let page = render(vec![run]);
    assert_well_formed(&page);
    assert!(!page.contains("<script") && !page.contains("<b>\""));
    assert!(!page.contains(|c: char| c.is_control() && c != '\n' && c != '\t'));
    for part in [
        "&lt;script&gt;alert('x')&lt;/script&gt;&quot;&amp;lt; | \\input{x}",
        "$'--asset=bun\\x1b[2J\\'s'",
        "softvt replay $'/nowhere/it\\'s &lt;b&gt;\\x1b[31m' 0/1",
    ] {
        assert!(page.contains(part), "{part} in {page}");
    }
}

/// A page with a controller that keeps one number constant, one that crushes, a client in progress, rigid objects,
/// conditions of two factors, and the picture of an object.
#[test]
fn a_page_is_self_contained_and_accessible() {
    let mut blind = stored("runs/a", "drives", episodes("soft", 4));
    blind.manifest.blind = true;
    let mut crusher = stored("runs/b", "expert", episodes("soft", 4));
    for record in &mut crusher.records {
        record.verdict.safety = false;
        let of = record.verdict.object_mut();
        (of.deformation_ok, of.d_peak, of.collapsed_volume_pct) = (Some(false), Some(9.0), Some(67.0));
    }
    let mut client = stored("runs/mine", "client", episodes("served", 3));
    client.manifest.profile = Profile::named("vision");
    (client.is_finished, client.manifest.episodes, client.manifest.softvt) = (false, 20, "0.0.1".to_owned());
    let mut rigid = stored("runs/rigid", "pi", episodes("rigid", 2));
    for record in &mut rigid.records {
        record.verdict.targets = vec![TargetVerdict::default()];
    }
    let condition = |dir: &str, change: Option<(&str, f64)>| {
        let mut run = stored(dir, "pi", episodes("soft", 12));
        run.manifest.shifts.extend(change.map(|(name, value)| shift(name, value)));
        run
    };
    let runs = summarize_runs(vec![
        blind,
        crusher,
        client,
        rigid,
        condition("c/mass", Some(("mass", 2.5))),
        condition("c/light", Some(("mass", 1.25))),
        condition("c/soft", Some(("stiffness", 0.1))),
        condition("c/stiff", Some(("stiffness", 10.0))),
        condition("c/reference", None),
    ]);
    let asset = runs[0].run.records[0].header.asset.clone();
    let picture = RgbImage::from_pixel(128, 128, image::Rgb([9, 80, 200]));
    let page = page(&runs, &Thumbnails::from([(asset, picture)]), Path::new("."));
    assert_well_formed(&page);
    for word in ["http:", "https:", "src=\"/", "@import", "url("] {
        assert!(!page.contains(word), "{word}");
    }
    let drawn: Vec<&str> = page.split("<svg").skip(1).collect();
    let named = |svg: &&str| {
        let (tag, _) = svg.split_once('>').expect("a tag ends");
        tag.contains("aria-hidden=\"true\"") || tag.contains("aria-label=\"")
    };
    assert!(drawn.len() > 4 && drawn.iter().all(named));
    let (head, body) = page.split_once("</style>").expect("a style sheet");
    let (head, _) = head.split_once("<style>").expect("a style sheet");
    let (before, image) = body.split_once("data:image/jpeg;base64,").expect("a picture");
    let (_, after) = image.split_once('"').expect("it ends");
    let shown =
        [head, before, after].concat().replace(env!("CARGO_PKG_VERSION"), "VERSION").replace('<', "\n<");
    insta::assert_snapshot!("page", shown);
}

#[test]
fn stills_are_embedded_and_link_to_their_videos() {
    let root = tempfile::tempdir().unwrap();
    let dir = root.path().join("run");
    let folder = dir.join("video/task_000");
    fs::create_dir_all(&folder).unwrap();
    image::RgbImage::new(64, 66).save(folder.join("episode_00001.png")).unwrap();
    fs::write(folder.join("episode_00001.mp4"), b"a video").unwrap();
    let run = stored(&dir.display().to_string(), "noop", episodes("soft", 4));
    let out = root.path().join("page");
    fs::create_dir_all(&out).unwrap();
    let page = page(&summarize_runs(vec![run]), &Thumbnails::new(), &out);
    assert_well_formed(&page);
    let link = "<a href=\"../run/video/task_000/episode_00001.mp4\">";
    assert!(page.contains(&format!("{link}<img src=\"data:image/jpeg;base64,")), "{page}");
    let (_, alt) = page.split_once("alt=\"Task 0 episode 1, bun, ").expect("the text of the picture");
    assert!(alt.split_once('"').is_some_and(|(alt, _)| alt.ends_with(", coloured by strain")), "{page}");
    assert!(page.contains(&format!("{link}video<span class=\"hidden\"> of task 0 episode 1</span></a>")));
    assert!(page.contains("--episode 3 --policy noop"), "the other one was not rendered");
}

#[test]
fn pages_of_forty_runs_and_of_none_are_valid() {
    let runs = (0..40).map(|i| {
        let name = "a policy with a very long name ".repeat(6) + &i.to_string();
        stored(&format!("runs/{i}"), &name, episodes(&format!("suite{}", i % 4), 30))
    });
    let page = render(runs.collect());
    assert_well_formed(&page);
    assert!(page.len() < 2 << 20, "{} bytes", page.len());
    let empty = stored("runs/empty", "noop", Vec::new());
    let page = render(vec![empty]);
    assert_well_formed(&page);
    assert!(page.contains("There is no episode yet."));
}

/// Relative luminance and contrast as WCAG 2.1 defines them.
fn contrast(a: &str, b: &str) -> f64 {
    let luminance = |hex: &str| {
        let part = |at: usize| {
            let c = f64::from(u8::from_str_radix(&hex[at..at + 2], 16).expect("a colour")) / 255.0;
            if c <= 0.03928 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
        };
        0.2126 * part(1) + 0.7152 * part(3) + 0.0722 * part(5)
    };
    let (a, b) = (luminance(a), luminance(b));
    (a.max(b) + 0.05) / (a.min(b) + 0.05)
}

#[test]
fn text_and_marks_have_contrast_in_all_colour_schemes() {
    let mut schemes = 0;
    for scheme in include_str!("page.css").split(":root {").skip(1) {
        let (block, _) = scheme.split_once('}').expect("it ends");
        let colours: BTreeMap<&str, &str> = block
            .split(';')
            .filter_map(|pair| pair.trim().split_once(": "))
            .filter_map(|(name, value)| Some((name.strip_prefix("--")?, value)))
            .collect();
        for ground in ["back", "card"] {
            for (ink, least) in [("ink", 7.0), ("soft", 4.5), ("link", 4.5), ("overtext", 4.5)]
                .into_iter()
                .chain(["safe", "over", "faint"].map(|c| (c, 3.0)))
            {
                let found = contrast(colours[ink], colours[ground]);
                assert!(found >= least, "{ink} on {ground}: {found:.2} in {block}");
            }
        }
        for (ink, ground) in [("onover", "cellover"), ("ink", "cellsafe")] {
            let found = contrast(colours[ink], colours[ground]);
            assert!(found >= 4.5, "{ink} on {ground}: {found:.2} in {block}");
        }
        let of_scheme = |colour: Colour| if schemes == 1 { colour.dark } else { colour.light };
        for (name, colour) in [("safe", SAFE), ("over", OVER_LIMIT), ("dropped", DROPPED), ("faint", FAINT)] {
            assert_eq!(colours[name], of_scheme(colour), "{name}: docs/looks.md states the colours");
        }
        schemes += 1;
    }
    assert_eq!(schemes, 3);
}

#[test]
fn invalid_episodes_are_not_told_as_drops() {
    let mut records = episodes("suite", 4);
    for record in &mut records[2..] {
        record.verdict.no_drop = false;
    }
    let told =
        |records: &[EpisodeRecord]| render(vec![stored("a", "pi", records.to_vec())]).contains("pi drops");
    assert!(told(&records));
    for record in &mut records[2..] {
        record.outcome = Outcome::Error { message: "no actions".to_owned() };
    }
    assert!(!told(&records));
}

#[test]
fn the_page_of_looks_states_the_marks_and_colours() {
    use softvt_evaluation::category::EpisodeCategory;
    let looks = include_str!("../../../docs/looks.md");
    for category in EpisodeCategory::ALL {
        let row = format!("| {} | {} |", category.glyph(), category.name());
        assert!(looks.contains(&row), "{row}");
    }
    for colour in [SAFE, OVER_LIMIT, DROPPED, FAINT] {
        assert!([colour.light, colour.dark].iter().all(|hex| looks.contains(hex)), "{colour:?}");
    }
}
