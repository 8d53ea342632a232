use crate::sample_record;
use std::{collections::BTreeMap, fs};

use super::*;
use crate::run_summary::{
    summarize_runs,
    tests::{shift, stored},
};
use softvt_evaluation::verdict::TargetVerdict;
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
fn hostile_names_are_escaped() {
    let mut records = episodes(HOSTILE, 4);
    for record in &mut records {
        (record.header.prompt, record.header.asset) = (HOSTILE.into(), HOSTILE.into());
        record.stats.gave_up = Some(HOSTILE.into());
    }
    let mut run = stored("/nowhere/it's <b>", HOSTILE, records);
    run.manifest.arguments.push(format!("--name={HOSTILE}"));
    run.manifest.shifts.push(shift(HOSTILE, 2.0));
    let page = render(vec![run]);
    assert_well_formed(&page);
    assert!(!page.contains("<script") && !page.contains("<b>\""));
    assert!(page.contains("&lt;script&gt;alert('x')&lt;/script&gt;&quot;&amp;lt; | \\input{x}"));
    assert!(page.contains("softvt replay '/nowhere/it'\\''s &lt;b&gt;' 0/1"), "quoted for a shell");
}

#[test]
fn control_characters_of_names_are_escaped() {
    let hostile = "bun\u{1b}[2J's";
    let mut records = episodes("soft", 4);
    for record in &mut records {
        (record.header.prompt, record.header.asset) = (hostile.into(), hostile.into());
    }
    let mut run = stored("/nowhere/\u{1b}[31mrun", "noop", records);
    run.manifest.arguments.push(format!("--asset={hostile}"));
    let page = render(vec![run]);
    assert_well_formed(&page);
    assert!(!page.contains(|c: char| c.is_control() && c != '\n' && c != '\t'));
    assert!(page.contains("$'--asset=bun\\x1b[2J\\'s'"), "{page}");
    assert!(page.contains("softvt replay $'/nowhere/\\x1b[31mrun' 0/1"), "{page}");
}

#[test]
fn the_page_is_self_contained_and_accessible() {
    let mut rigid = episodes("rigid", 2);
    for record in &mut rigid {
        record.verdict.targets = vec![TargetVerdict::default()];
    }
    let page = render(vec![stored("a", "expert", episodes("soft", 9)), stored("b", "pi", rigid)]);
    assert_well_formed(&page);
    for word in ["http:", "https:", "src=\"/", "@import", "url("] {
        assert!(!page.contains(word), "{word}");
    }
    assert!(
        page.contains("<html lang=\"en\">")
            && page.contains("<th scope=\"col\"")
            && page.contains("<figcaption id=\"results-table\">")
    );
    assert!(page.matches("<th scope=\"row\"").count() > 4);
    let drawn: Vec<&str> = page.split("<svg").skip(1).collect();
    let named = |svg: &&str| {
        let (tag, _) = svg.split_once('>').expect("a tag ends");
        tag.contains("aria-hidden=\"true\"") || tag.contains("aria-label=\"")
    };
    assert!(drawn.len() > 4 && drawn.iter().all(named));
    assert!(page.contains("expert (privileged)") && page.contains("which no robot has"));
    assert!(page.contains("N/A") && page.contains("D 1.50\u{a0}% is above τ\u{a0}1.00\u{a0}%"));
    assert!(page.contains("expert is over the limit in 4 of 9 episodes."), "a sentence says so");
    assert!(page.contains("softvt view x.lua --task 0 --episode 1 --policy expert --seed 11 --out seen"));
}

#[test]
fn constant_numbers_and_pictures_of_objects_are_shown() {
    let mut blind = stored("a", "drives", episodes("soft", 4));
    blind.manifest.blind = true;
    let runs = summarize_runs(vec![blind, stored("b", "pi", episodes("soft", 9))]);
    let asset = runs[0].run.records[0].header.asset.clone();
    let picture = RgbImage::from_pixel(128, 128, image::Rgb([9, 80, 200]));
    let page = page(&runs, &Thumbnails::from([(asset, picture)]), Path::new("."));
    assert_well_formed(&page);
    assert_eq!(page.matches("<line class=\"bound\"").count(), 2, "beside every policy of the suite");
    assert!(page.contains("keeps one number constant (drives, 50 %)."), "{page}");
    assert_eq!(page.matches(">one constant number</span>").count(), 1);
    assert_eq!(page.matches("<img src=\"data:image/jpeg;base64,").count(), 1);
    assert!(
        page.contains("<h3 id=\"failures-0\">soft, drives") && page.contains("href=\"#failures-0\""),
        "{page}"
    );
}

#[test]
fn an_episode_of_a_policy_server_or_a_client_is_viewed_by_its_actions() {
    let mut run = stored("runs/mine", "client", episodes("soft", 4));
    run.manifest.profile = Profile::named("vision");
    let page = render(vec![run]);
    assert!(page.contains("--episode 1 --policy runs/mine --seed 11"), "{page}");
}

/// A run of 20 episodes under a shift, every second of which is unsafe.
fn shifted(dir: &str, change: Option<(&str, f64)>) -> StoredRun {
    let mut run = stored(dir, "pi", episodes("soft", 20));
    run.manifest.shifts.extend(change.map(|(name, value)| shift(name, value)));
    run
}

#[test]
fn trends_have_intervals_and_named_axes() {
    let page = render(vec![
        shifted("b", Some(("mass", 2.5))),
        shifted("c", Some(("mass", 1.25))),
        shifted("d", Some(("stiffness", 0.1))),
        shifted("e", Some(("stiffness", 10.0))),
        shifted("a", None),
    ]);
    assert_well_formed(&page);
    assert!(page.contains("href=\"#conditions\""), "the contents list the section");
    let (_, figure) = page.split_once("class=\"panels\"").expect("a figure of trends");
    let (figure, _) = figure.split_once("</figure>").expect("it ends");
    let panels: Vec<&str> = figure.split("class=\"axes\"").skip(1).collect();
    let [mass, stiffness] = panels[..] else { panic!("two factors: {figure}") };
    for panel in panels {
        // Safety of the reference and at two values, each with an interval, and D/τ of each of 20 episodes.
        assert_eq!(
            (panel.matches("whisker").count(), panel.matches("r=\"2.4\"").count()),
            (3, 60),
            "{panel}"
        );
        assert!(
            [">0 %<", ">50 %<", ">100 %<", ">ref.<"].iter().all(|label| panel.contains(label)),
            "{panel}"
        );
    }
    assert!(mass.contains("value of mass<") && mass.find(">1.25<") < mass.find(">2.5<"), "{mass}");
    assert!(stiffness.contains("value of stiffness, log<"), "{stiffness}");
    assert!(page.contains("under 4 conditions Safety stays at 50 %"), "{page}");
    // The reference comes first in the tables and figures.
    assert!(page.find("pi · mass=1.25") < page.find("pi · mass=2.5"), "{page}");
    assert!(page.find("<th class=\"text\" scope=\"row\">pi</th>") < page.find("pi · mass=1.25"), "{page}");
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

#[test]
fn a_run_in_progress_or_of_another_version_is_reported() {
    let mut run = stored("runs/a", "noop", episodes("soft", 3));
    (run.is_finished, run.manifest.episodes, run.manifest.softvt) = (false, 20, "0.0.1".to_owned());
    let page = render(vec![run]);
    assert!(page.contains("runs/a is not finished: it has 3 of 20 episodes"), "{page}");
    assert!(page.contains("runs/a was written by softvt 0.0.1"));
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

#[test]
fn a_sentence_names_who_crushes_and_never_more_than_the_volume_shows() {
    let run = |policy: &str, collapsed: f64, over: bool| {
        let mut records = episodes("soft", 4);
        for record in &mut records {
            record.verdict.safety = !over;
            let of = record.verdict.object_mut();
            (of.deformation_ok, of.d_peak) = (Some(!over), Some(if over { 9.0 } else { 0.5 }));
            of.collapsed_volume_pct = Some(collapsed);
        }
        stored(&format!("runs/{policy}"), policy, records)
    };
    let page = render(vec![run("gentle", 0.0, false), run("hard", 3.0, true), run("crusher", 67.0, true)]);
    assert!(page.contains("All 3 policies bring every object to its goal."), "{page}");
    assert!(
        page.contains("crusher crushes the object in 4 of 4 episodes (67 % of the volume collapsed)."),
        "{page}"
    );
    assert!(page.contains("hard is over the limit in 4 of 4 episodes."), "{page}");
    assert!(page.contains("gentle</b> stays within the limit."), "{page}");
    assert!(page.contains("9.0\u{a0}× limit, crushed: 67\u{a0}% collapsed"), "{page}");
}
