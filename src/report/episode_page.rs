//! The page of one episode: what happened in a sentence, the video, and the stills of every camera and finger; and that
//! of one episode under several policies.

use std::path::Path;

use data_encoding::BASE64;
use image::{ImageFormat, Luma, Rgb, RgbImage};
use maud::{DOCTYPE, Markup, PreEscaped, html};

use crate::{
    run_summary::failures,
    video::{CLOSE_UP_STILL, place, worst_state},
};
use softvt_benchmark::CONTROL_DT;
use softvt_common::{
    files::{self, FileError},
    text::escape_control,
};
use softvt_evaluation::{stage::TaskStage, verdict::TargetVerdict};
use softvt_rollout::StateRecording;
use softvt_runs::record::EpisodeRecord;

/// Name of the page in the folder of the stills.
pub const PAGE: &str = "index.html";
/// Name of the video in that folder.
pub const VIDEO: &str = "episode.mp4";
/// Name of a frame of the video in that folder.
pub const FRAME: &str = "episode.png";
/// Names of the moments of stills, in the names of files and in words.
const MOMENTS: [(&str, &str); 3] =
    [("worst", "At the worst moment"), ("start", "At the start"), ("end", "At the end")];
/// Stills of a moment, by the names of files and in words.
const STILLS: [(&str, &str); 7] = [
    (CLOSE_UP_STILL, "object from nearby; red: beyond the stable strain"),
    ("third_person", "third person"),
    ("wrist", "wrist"),
    ("tactile_left_arrows", "left finger, motion of the markers"),
    ("tactile_right_arrows", "right finger, motion of the markers"),
    ("tactile_left", "left finger"),
    ("tactile_right", "right finger"),
];
/// Cameras with depth and segmentation.
const CAMERAS: [&str; 2] = ["third_person", "wrist"];
/// Colours of the objects of a segmentation, in turn, by Okabe and Ito.
const OBJECT_COLOURS: [[u8; 3]; 7] = [
    [86, 180, 233],
    [230, 159, 0],
    [0, 158, 115],
    [204, 121, 167],
    [240, 228, 66],
    [0, 114, 178],
    [213, 94, 0],
];
const STYLE: &str = "body{margin:1.5rem auto;max-width:70rem;padding:0 1rem;font:15px/1.5 system-ui,sans-serif}\
    :root{color-scheme:light dark}h1{font-size:18px}h2{font-size:15px;margin:1.5rem 0 .4rem}\
    video{width:100%;max-width:46rem}ul{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(13rem,46%),1fr));\
    gap:.7rem;list-style:none;padding:0}img{width:100%;height:auto;display:block;border-radius:5px}li{font-size:13px}";

/// Further style of the page of several policies.
const STYLE_OF_SEVERAL: &str =
    "h3{font-size:13px;margin:.8rem 0 .3rem}.said{display:block}.said li{font-size:15px}";

/// Least D over τ that two decimals show.
const SMALLEST_RATIO: f64 = 0.005;

/// When the deformation of a target was largest, and when one first passed its limit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DeformationTimes {
    /// Time of the largest D, s.
    pub worst_s: f64,
    /// Time at which D was first above the limit, s, and the stage of the episode then.
    pub passed: Option<(f64, Option<TaskStage>)>,
}

impl DeformationTimes {
    pub fn new(states: &StateRecording) -> Self {
        let time_s = |state: usize| state as f64 * CONTROL_DT;
        let passed = states.deformation.iter().position(|of| of.is_some_and(|of| of.is_over()));
        let passed = passed.map(|state| (time_s(state), states.stages.get(state).copied().flatten()));
        Self { worst_s: time_s(worst_state(states)), passed }
    }
}

/// Result of an episode, and reasons of a failure: "✗ over the limit: D 1.93 % = 5.14 × limit at 4.95 s; above the
/// limit from 4.20 s, in the stage place".
pub fn sentence(record: &EpisodeRecord, times: &DeformationTimes) -> String {
    // An object that was hardly touched is not described by its D.
    let is_touched = |target: &TargetVerdict| target.ratio() >= Some(SMALLEST_RATIO);
    let d = record.deformation_in_words().filter(|_| record.verdict.most_deformed().is_none_or(is_touched));
    let d = d.map_or_else(String::new, |d| format!(": {d} at {:.2} s", times.worst_s));
    let collapsed = record.crushed_volume_pct().map(|pct| format!(", {pct:.0} % of the volume collapsed"));
    let seen = format!(
        "{} {}{d}{}",
        record.category().glyph(),
        record.result_and_harm(),
        collapsed.unwrap_or_default()
    );
    let passed = times.passed.map(|(time_s, stage)| {
        let stage = stage.map_or(String::new(), |stage| format!(", in the stage {}", stage.name()));
        format!("above the limit from {time_s:.2} s{stage}")
    });
    let failures = if record.verdict.safety { Vec::new() } else { failures(record) };
    std::iter::once(seen).chain(passed).chain(failures).collect::<Vec<_>>().join("; ")
}

/// An episode under one of several policies.
pub struct PolicyPart<'a> {
    pub record: &'a EpisodeRecord,
    pub times: DeformationTimes,
    /// Name of the folder of its stills in the folder of the page.
    pub folder: String,
}

impl PolicyPart<'_> {
    /// Result under the policy: "expert: ● safe: D 0.09 % = 0.36 × limit at 4.45 s".
    pub fn sentence(&self) -> String {
        format!("{}: {}", self.record.header.policy, sentence(self.record, &self.times))
    }
}

/// Writes [`PAGE`] about one episode under several policies: a sentence for each, the video in the folder `dir`, and
/// each policy's stills, with a link to the page of its own that is written next to them.
pub fn write_several(parts: &[PolicyPart], dir: &Path) -> Result<(), FileError> {
    let Some(PolicyPart { record, .. }) = parts.first() else { return Ok(()) };
    for PolicyPart { record, times, folder } in parts {
        write(record, times, &dir.join(folder))?;
    }
    let title = place(record);
    let contents = html! {
        h1 { (title) }
        p { (record.header.prompt) }
        ul.said { @for part in parts { li { (part.sentence()) } } }
        video controls muted src=(VIDEO) poster=(FRAME) {}
        @for (moment, words) in MOMENTS {
            h2 { (words) }
            @for PolicyPart { record, folder, .. } in parts {
                @let policy = &record.header.policy;
                h3 { a href=(format!("{folder}/{PAGE}")) { (policy) } }
                ul { (stills(moment, &format!("{policy}, {}", words.to_lowercase()), dir, &format!("{folder}/"))) }
            }
        }
    };
    let style = format!("{STYLE}{STYLE_OF_SEVERAL}");
    files::replace(&dir.join(PAGE), page(&title, &style, &contents).as_bytes())
}

/// Writes [`PAGE`] about the video and the stills in the folder `dir`. Depth and segmentation, which viewers show white
/// and black, are drawn in grey and in colours.
pub fn write(record: &EpisodeRecord, times: &DeformationTimes, dir: &Path) -> Result<(), FileError> {
    let header = &record.header;
    let title = place(record) + " · " + &header.policy;
    let contents = html! {
        h1 { (sentence(record, times)) }
        p { (title) br; (header.prompt) }
        @if dir.join(VIDEO).is_file() { video controls muted src=(VIDEO) poster=(FRAME) {} }
        @for (moment, words) in MOMENTS { h2 { (words) } ul { (stills(moment, words, dir, "")) } }
    };
    files::replace(&dir.join(PAGE), page(&title, STYLE, &contents).as_bytes())
}

fn page(title: &str, style: &str, contents: &Markup) -> String {
    let markup = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) }
                style { (PreEscaped(style)) }
            }
            body { main { (contents) } }
        }
    };
    escape_control(&markup.into_string()).into_owned()
}

/// The stills of a moment; `folder` has their files in `dir`, with a slash, or is empty.
fn stills(moment: &str, words: &str, dir: &Path, folder: &str) -> Markup {
    let still = |source: String, what: &str| {
        html! { li { img src=(source) alt=(format!("{words}: {what}")); (what) } }
    };
    html! {
        @for (name, what) in STILLS {
            @let file = format!("{folder}{moment}_{name}.png");
            @if dir.join(&file).is_file() { (still(file, what)) }
        }
        @for camera in CAMERAS {
            @let numbers = |suffix: &str| image::open(dir.join(format!("{folder}{moment}_{camera}_{suffix}.png"))).ok();
            @if let Some(depth) = numbers("depth").and_then(|image| data_url(&grey_depth(&image.into_luma16()))) {
                (still(depth, &format!("{}, depth: near is bright", camera.replace('_', " "))))
            }
            @if let Some(objects) = numbers("segmentation").and_then(|image| data_url(&coloured(&image.into_luma16()))) {
                (still(objects, &format!("{}, objects by colour", camera.replace('_', " "))))
            }
        }
    }
}

type Numbers = image::ImageBuffer<Luma<u16>, Vec<u16>>;

/// Depth in grey, from the nearest to the farthest.
fn grey_depth(depth: &Numbers) -> RgbImage {
    let known = || depth.pixels().map(|pixel| pixel.0[0]).filter(|depth| *depth > 0);
    let (near, far) = (known().min().unwrap_or(0), known().max().unwrap_or(1));
    let grey =
        |depth: u16| 255 - (235 * (u32::from(depth.max(near) - near)) / u32::from((far - near).max(1))) as u8;
    RgbImage::from_fn(depth.width(), depth.height(), |x, y| Rgb([grey(depth.get_pixel(x, y).0[0]); 3]))
}

/// Objects by colour; 0 is black.
fn coloured(objects: &Numbers) -> RgbImage {
    let colour = |object: u16| match object {
        0 => [0; 3],
        object => OBJECT_COLOURS[usize::from(object) % OBJECT_COLOURS.len()],
    };
    RgbImage::from_fn(objects.width(), objects.height(), |x, y| Rgb(colour(objects.get_pixel(x, y).0[0])))
}

fn data_url(image: &RgbImage) -> Option<String> {
    let mut png = std::io::Cursor::new(Vec::new());
    image.write_to(&mut png, ImageFormat::Png).ok()?;
    Some(format!("data:image/png;base64,{}", BASE64.encode(png.get_ref())))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample_record;

    fn at_one_second() -> DeformationTimes {
        DeformationTimes { worst_s: 1.0, passed: None }
    }

    #[test]
    fn the_sentence_names_the_category_and_the_multiple_of_the_limit() {
        let mut record = sample_record();
        let at = |worst_s: f64| DeformationTimes { worst_s, passed: None };
        assert_eq!(sentence(&record, &at(2.0)), "● safe: D 0.33 % = 0.33 × limit at 2.00 s");
        (record.verdict.object_mut().d_peak, record.verdict.object_mut().deformation_ok) =
            (Some(5.1), Some(false));
        record.verdict.safety = false;
        assert_eq!(sentence(&record, &at(4.95)), "✗ over the limit: D 5.10 % = 5.10 × limit at 4.95 s");
    }

    #[test]
    fn the_sentence_says_why_an_episode_failed_and_when_d_passed_the_limit() {
        let mut record = sample_record();
        (record.verdict.object_mut().d_peak, record.verdict.object_mut().deformation_ok) =
            (Some(5.1), Some(false));
        record.verdict.safety = false;
        let times = DeformationTimes { worst_s: 4.95, passed: Some((4.2, Some(TaskStage::Place))) };
        let text = sentence(&record, &times);
        assert!(text.ends_with(" at 4.95 s; above the limit from 4.20 s, in the stage place"), "{text}");
        record.stats.gave_up = Some("table is in the way".to_owned());
        (record.verdict.goal, record.verdict.failed_stage) = (false, Some(TaskStage::Reach));
        let text = sentence(&record, &DeformationTimes::default());
        assert!(text.contains("; gave up: table is in the way; failed while: reach"), "{text}");
    }

    #[test]
    fn the_page_shows_the_stills_of_its_folder_with_depth_in_grey_and_objects_in_colour() {
        let root = tempfile::tempdir().unwrap();
        let numbers = Numbers::from_fn(4, 4, |x, _| Luma([9000 + 100 * x as u16]));
        numbers.save(root.path().join("start_wrist_depth.png")).unwrap();
        RgbImage::new(4, 4).save(root.path().join("start_wrist.png")).unwrap();
        let mut record = sample_record();
        record.header.prompt = "<b>wait\u{1b}[2J".to_owned();
        write(&record, &at_one_second(), root.path()).unwrap();
        let page = std::fs::read_to_string(root.path().join(PAGE)).unwrap();
        assert!(
            page.contains("&lt;b&gt;wait\\u{1b}[2J") && page.contains("src=\"start_wrist.png\""),
            "{page}"
        );
        assert_eq!(page.matches("<img ").count(), 2, "{page}");
        record.header.policy = "a<b".to_owned();
        let part = PolicyPart { record: &record, times: at_one_second(), folder: "a_b".to_owned() };
        std::fs::create_dir(root.path().join("a_b")).unwrap();
        RgbImage::new(4, 4).save(root.path().join("a_b/worst_wrist.png")).unwrap();
        write_several(&[part], root.path()).unwrap();
        let several = std::fs::read_to_string(root.path().join(PAGE)).unwrap();
        for text in [
            "<li>a&lt;b: ● safe: D 0.33 % = 0.33 × limit at 1.00 s</li>",
            "href=\"a_b/index.html\"",
            "src=\"a_b/worst_wrist.png\"",
        ] {
            assert!(several.contains(text), "{text}: {several}");
        }
        assert!(root.path().join("a_b").join(PAGE).is_file(), "a page of its own");
        let grey = grey_depth(&numbers);
        assert_eq!([grey.get_pixel(0, 0).0[0], grey.get_pixel(3, 0).0[0]], [255, 20]);
        assert_eq!(coloured(&Numbers::from_pixel(1, 1, Luma([1]))).get_pixel(0, 0).0, OBJECT_COLOURS[1]);
    }
}
