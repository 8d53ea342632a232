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
