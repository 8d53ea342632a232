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

/// The style sheet of an image. It has no variables, which many programs other than browsers do not read.
fn style() -> String {
    format!(
        "{}.title{{font-weight:600}}.curve{{fill:none;stroke-width:1.6}}.limit{{stroke-dasharray:5 4}}\
         .over{{stroke-width:2;stroke-opacity:.5}}text.over{{stroke:none;font-weight:600}}.band{{fill-opacity:.15}}\
         .pressed{{fill:url(#hatch)}}",
        on_both_grounds(colour_rules)
    )
}

/// Rules of a style sheet for light ground, and those for dark ground where the reader prefers it.
pub(super) fn on_both_grounds(rules: impl Fn(fn(&Colour) -> &'static str) -> String) -> String {
    let (light, dark) = (rules(|colour| colour.light), rules(|colour| colour.dark));
    format!("{light}@media(prefers-color-scheme:dark){{{dark}}}")
}

/// The rules about colours.
fn colour_rules(of: fn(&Colour) -> &'static str) -> String {
    let colours =
        [palette::INK, palette::RULE, palette::GROUND, palette::FAINT, palette::SAFE, palette::OVER_LIMIT];
    let [ink, rule, ground, soft, safe, over] = colours.each_ref().map(of);
    format!(
        "text{{fill:{ink}}}.soft{{fill:{soft}}}.ground{{fill:{ground}}}.axis{{stroke:{ink}}}.grid{{stroke:{rule}}}\
         .curve{{stroke:{safe}}}.dot,.bar{{fill:{safe}}}.dot,.ring{{stroke:{safe}}}.ring,.mark-ring{{fill:{ground}}}\
         .mark{{fill:{ink}}}.mark,.mark-ring{{stroke:{ink}}}.limit{{stroke:{over}}}.over{{stroke:{over}}}\
         text.over{{fill:{over}}}.end{{stroke:{safe}}}.band{{fill:{safe}}}"
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_plain_ones_for_programs_without_variables() {
        let image = image(10.0, 10.0, 12.0, "a", "");
        let (light, dark) = image.split_once("@media(prefers-color-scheme:dark)").expect("two grounds");
        assert!(!image.contains("var(") && light.contains("text{fill:#1c2024}"), "{image}");
        assert!(dark.contains("text{fill:#e6e8eb}"), "{image}");
    }
}
