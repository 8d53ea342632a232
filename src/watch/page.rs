//! The files of the page, which the program contains.

#[derive(Clone, Copy, Debug)]
pub(crate) struct PageFile {
    pub(crate) content: &'static [u8],
    pub(crate) kind: &'static str,
}

pub(crate) fn file(path: &str) -> Option<PageFile> {
    let (content, kind): (&[u8], _) = match path {
        "/" => (include_bytes!("page/index.html"), "text/html; charset=utf-8"),
        "/style.css" => (include_bytes!("page/style.css"), "text/css"),
        "/watch.js" => (include_bytes!("page/watch.js"), "text/javascript"),
        "/scene.js" => (include_bytes!("page/scene.js"), "text/javascript"),
        "/plots.js" => (include_bytes!("page/plots.js"), "text/javascript"),
        "/message.js" => (include_bytes!("page/message.js"), "text/javascript"),
        "/three.js" => (include_bytes!("page/three/three.min.js"), "text/javascript"),
        _ => return None,
    };
    Some(PageFile { content, kind })
}

#[cfg(test)]
mod tests {
    use softvt_media::palette::{FAINT, GROUND, INK, OVER_LIMIT, RULE, SAFE};

    #[test]
    fn the_page_has_no_colours_of_its_own_for_text_ground_and_verdicts() {
        let page = include_str!("page/style.css");
        let named = [("ink", INK), ("paper", GROUND), ("line", RULE), ("mute", FAINT)];
        for (name, colour) in named.into_iter().chain([("safe", SAFE), ("harm", OVER_LIMIT)]) {
            for of_scheme in [colour.light, colour.dark] {
                assert!(page.contains(&format!("--{name}: {of_scheme};")), "{name}: {of_scheme}");
            }
        }
    }
}
