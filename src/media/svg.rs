//! Elements of SVG images. All images have one style: the colours of [`palette`], on light and on dark ground, by the
//! classes of [`image()`].

use super::palette::{self, Colour};

/// End of a text at its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    /// The text begins there.
    Start,
    /// The text is centred.
    Middle,
    /// The text ends there.
    End,
}

/// A place in an image, px.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// From the left.
    pub x: f64,
    /// From the top.
    pub y: f64,
}

/// Short for a place.
pub fn at(x: f64, y: f64) -> Place {
    Place { x, y }
}

/// A rectangle in an image, px.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Area {
    /// Left edge.
    pub x: f64,
    /// Upper edge.
    pub y: f64,
    /// Width.
    pub width: f64,
    /// Height.
    pub height: f64,
}

/// A whole image. Its classes are `axis`, `grid`, `soft` (text), `title`, `curve`, `dot`, `ring`, `mark`, `mark-ring`,
/// `limit`, `end`, `band`, `pressed` and `bar`. `label` says what the image shows.
pub fn image(width: f64, height: f64, font_size: f64, label: &str, contents: &str) -> String {
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" role=\"img\" \
         font-family=\"system-ui, sans-serif\" font-size=\"{font_size}\">\n<title>{}</title>\n<style>{}</style>\n\
         <defs><pattern id=\"hatch\" width=\"8\" height=\"8\" patternUnits=\"userSpaceOnUse\" \
         patternTransform=\"rotate(45)\"><path class=\"over\" d=\"M0 0V8\"/></pattern></defs>\n\
         <rect class=\"ground\" width=\"{width}\" height=\"{height}\"/>\n{contents}</svg>\n",
        escaped(label),
        style()
    )
}

/// The style sheet of an image.
fn style() -> String {
    let colours = [
        ("ink", palette::INK),
        ("rule", palette::RULE),
        ("ground", palette::GROUND),
        ("soft", palette::FAINT),
        ("safe", palette::SAFE),
        ("over", palette::OVER_LIMIT),
    ];
    let all = |of: fn(&Colour) -> &'static str| {
        let pairs = colours.iter().map(|(name, colour)| format!("--{name}:{}", of(colour)));
        pairs.collect::<Vec<_>>().join(";")
    };
    format!(
        "svg{{{}}}@media(prefers-color-scheme:dark){{svg{{{}}}}}\
         text{{fill:var(--ink)}}.soft{{fill:var(--soft)}}.title{{font-weight:600}}.ground{{fill:var(--ground)}}\
         .axis{{stroke:var(--ink)}}.grid{{stroke:var(--rule)}}.curve{{fill:none;stroke:var(--safe);stroke-width:1.6}}\
         .dot,.bar{{fill:var(--safe)}}.dot,.ring{{stroke:var(--safe)}}.ring,.mark-ring{{fill:var(--ground)}}\
         .mark{{fill:var(--ink)}}.mark,.mark-ring{{stroke:var(--ink)}}.limit{{stroke:var(--over);stroke-dasharray:5 4}}\
         .over{{stroke:var(--over);stroke-width:2;stroke-opacity:.5}}text.over{{fill:var(--over);stroke:none;font-weight:600}}\
         .end{{stroke:var(--safe)}}.band{{fill:var(--safe);fill-opacity:.15}}.pressed{{fill:url(#hatch)}}",
        all(|colour| colour.light),
        all(|colour| colour.dark)
    )
}

fn escaped(text: &str) -> String {
    // XML has no control characters, and no end of a section in a text.
    let printed: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    printed.replace('&', "&amp;").replace('<', "&lt;").replace("]]>", "]]&gt;")
}

/// A text.
pub fn text(place: Place, anchor: Anchor, class: &str, what: &str) -> String {
    let anchor = match anchor {
        Anchor::Start => "start",
        Anchor::Middle => "middle",
        Anchor::End => "end",
    };
    format!(
        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"{anchor}\"{}>{}</text>\n",
        place.x,
        place.y,
        class_of(class),
        escaped(what)
    )
}

/// A text from bottom to top, centred.
pub fn upward_text(place: Place, what: &str) -> String {
    let Place { x, y } = place;
    format!(
        "<text transform=\"translate({x:.1} {y:.1}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
        escaped(what)
    )
}

/// A line.
pub fn line(from: Place, to: Place, class: &str) -> String {
    format!(
        "<line x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\"{}/>\n",
        from.x,
        from.y,
        to.x,
        to.y,
        class_of(class)
    )
}

/// A line through several places.
pub fn polyline(places: &[Place], class: &str) -> String {
    let path: Vec<String> = places.iter().map(|Place { x, y }| format!("{x:.1},{y:.1}")).collect();
    format!("<polyline points=\"{}\"{}/>\n", path.join(" "), class_of(class))
}

/// A dot.
pub fn circle(centre: Place, radius: f64, class: &str) -> String {
    format!("<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"{radius}\"{}/>\n", centre.x, centre.y, class_of(class))
}

/// A square on its corner.
pub fn diamond(centre: Place, radius: f64, class: &str) -> String {
    let Place { x, y } = centre;
    let (left, right, top, bottom) = (x - radius, x + radius, y - radius, y + radius);
    format!(
        "<polygon points=\"{left:.1},{y:.1} {x:.1},{top:.1} {right:.1},{y:.1} {x:.1},{bottom:.1}\"{}/>\n",
        class_of(class)
    )
}

/// A rectangle.
pub fn rect(area: Area, class: &str) -> String {
    let Area { x, y, width, height } = area;
    format!(
        "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\"{}/>\n",
        class_of(class)
    )
}

fn class_of(class: &str) -> String {
    if class.is_empty() { String::new() } else { format!(" class=\"{class}\"") }
}
