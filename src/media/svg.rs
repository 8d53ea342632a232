//! Drawings as SVG images, on light and on dark ground.

use super::{
    drawing::{Anchor, Area, Element, Fill, Font, Place, Shape, Stroke, Symbol, Tone},
    palette::{self, Colour},
};

/// A whole image. `label` says what it shows.
pub fn image(width: f32, height: f32, font_size: f32, label: &str, elements: &[Element]) -> String {
    let contents: String = elements.iter().map(|element| shown(element, font_size)).collect();
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" role=\"img\" \
         font-family=\"system-ui, sans-serif\" font-size=\"{font_size}\">\n<title>{}</title>\n<style>{}</style>\n\
         <defs><pattern id=\"hatch\" width=\"8\" height=\"8\" patternUnits=\"userSpaceOnUse\" \
         patternTransform=\"rotate(45)\"><path class=\"gap\" d=\"M0 0V8\"/></pattern></defs>\n\
         <rect class=\"ground\" width=\"{width}\" height=\"{height}\"/>\n{contents}</svg>\n",
        escaped(label),
        style()
    )
}

/// The style sheet of an image. It has no variables, which many programs other than browsers do not read.
fn style() -> String {
    let [light, dark] = [|colour: &Colour| colour.light, |colour: &Colour| colour.dark].map(colour_rules);
    format!(
        "{light}@media(prefers-color-scheme:dark){{{dark}}}.title,text.strong{{font-weight:600}}\
         .curve{{fill:none;stroke-width:1.6}}.d1{{stroke-dasharray:7 3}}.d2{{stroke-dasharray:2 3}}\
         .limit{{stroke-dasharray:5 4}}.gap{{stroke-width:2;stroke-opacity:.5}}.band,.harm{{fill-opacity:.15}}.interval{{fill-opacity:.07}}\
         .hatched{{fill:url(#hatch)}}"
    )
}

fn colour_rules(of: fn(&Colour) -> &'static str) -> String {
    let colours =
        [palette::INK, palette::RULE, palette::GROUND, palette::FAINT, palette::SAFE, palette::OVER_LIMIT];
    let [ink, rule, ground, faint, safe, over] = colours.each_ref().map(of);
    format!(
        "text{{fill:{ink}}}text.faint{{fill:{faint}}}text.strong{{fill:{over}}}.ground{{fill:{ground}}}\
         .axis{{stroke:{ink}}}.grid{{stroke:{rule}}}.limit,.gap{{stroke:{over}}}.guide{{stroke:{safe}}}\
         .event,.whisker{{stroke:{faint}}}.curve.ink{{stroke:{ink}}}.curve.faint{{stroke:{faint}}}.curve.safe{{stroke:{safe}}}\
         .curve.over{{stroke:{over}}}.band,.bar{{fill:{safe}}}.harm{{fill:{over}}}.interval{{fill:{ink}}}.dot,.ring{{stroke:{safe}}}\
         .mark,.mark-ring{{stroke:{ink}}}.dot{{fill:{safe}}}.mark{{fill:{ink}}}.ring,.mark-ring{{fill:{ground}}}"
    )
}

fn shown(element: &Element, font_size: f32) -> String {
    match element {
        Element::Line(places, stroke) => line(places, *stroke),
        Element::Area(area, fill) => {
            let Area { left, top, .. } = area;
            let (width, height, class) = (area.width(), area.height(), fill.class());
            format!(
                "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" class=\"{class}\"/>\n"
            )
        }
        Element::Symbol(place, symbol) => symbol_at(*place, *symbol),
        Element::Text { place: Place { x, y }, shift, anchor, font, text } => {
            text_at(Place { x: x + shift, y: *y }, *anchor, *font, text)
        }
        Element::Tag { place: Place { x, y }, shift, text, .. } => {
            text_at(Place { x: x + shift, y: y + font_size }, Anchor::Start, Font::Plain(Tone::Ink), text)
        }
    }
}

impl Anchor {
    /// Value of `text-anchor`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Start => "start",
            Self::Middle => "middle",
            Self::End => "end",
        }
    }
}

impl Stroke {
    /// Classes of style sheets.
    pub fn class(self) -> String {
        let name = match self {
            Self::Axis => "axis",
            Self::Grid => "grid",
            Self::Limit => "limit",
            Self::Guide => "guide",
            Self::Event => "event",
            Self::Whisker => "whisker",
            Self::Gap => "gap",
            Self::Curve { tone, dash } => {
                let tone = match tone {
                    Tone::Ink => "ink",
                    Tone::Faint => "faint",
                    Tone::Safe => "safe",
                    Tone::Harm => "over",
                };
                return if dash == 0 { format!("curve {tone}") } else { format!("curve {tone} d{dash}") };
            }
        };
        name.to_owned()
    }
}

impl Fill {
    /// Class of style sheets.
    pub fn class(self) -> &'static str {
        match self {
            Self::Band => "band",
            Self::Hatched => "hatched",
            Self::Bar => "bar",
            Self::Harm => "harm",
            Self::Interval => "interval",
        }
    }
}

fn line(places: &[Place], stroke: Stroke) -> String {
    let class = stroke.class();
    if let [from, to] = places {
        return format!(
            "<line x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" class=\"{class}\"/>\n",
            from.x, from.y, to.x, to.y
        );
    }
    let path: Vec<String> = places.iter().map(|Place { x, y }| format!("{x:.1},{y:.1}")).collect();
    format!("<polyline points=\"{}\" class=\"{class}\" fill=\"none\"/>\n", path.join(" "))
}

fn symbol_at(Place { x, y }: Place, Symbol { shape, radius, tone, is_filled }: Symbol) -> String {
    let class = match (tone, is_filled) {
        (Tone::Ink, true) => "mark",
        (Tone::Ink, false) => "mark-ring",
        (_, true) => "dot",
        (_, false) => "ring",
    };
    match shape {
        Shape::Circle => format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\" class=\"{class}\"/>\n"),
        Shape::Diamond => {
            let (left, right, top, bottom) = (x - radius, x + radius, y - radius, y + radius);
            format!(
                "<polygon points=\"{left:.1},{y:.1} {x:.1},{top:.1} {right:.1},{y:.1} {x:.1},{bottom:.1}\" class=\"{class}\"/>\n"
            )
        }
    }
}

fn text_at(Place { x, y }: Place, anchor: Anchor, font: Font, text: &str) -> String {
    let anchor = anchor.name();
    if font == Font::Upward {
        let text = escaped(text);
        return format!(
            "<text transform=\"translate({x:.1} {y:.1}) rotate(-90)\" text-anchor=\"{anchor}\">{text}</text>\n"
        );
    }
    let class = match font {
        Font::Plain(Tone::Faint) | Font::Name(Tone::Faint) => " class=\"faint\"",
        Font::Plain(_) | Font::Name(_) | Font::Upward => "",
        Font::Title => " class=\"title\"",
        Font::Strong => " class=\"strong\"",
    };
    format!("<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\"{class}>{}</text>\n", escaped(text))
}

fn escaped(text: &str) -> String {
    // XML has no control characters, and no end of a section in a text.
    let printed: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    printed.replace('&', "&amp;").replace('<', "&lt;").replace("]]>", "]]&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_plain_ones_for_programs_without_variables() {
        let image = image(10.0, 10.0, 12.0, "a", &[]);
        let (light, dark) = image.split_once("@media(prefers-color-scheme:dark)").expect("two grounds");
        assert!(!image.contains("var(") && light.contains("text{fill:#1c2024}"), "{image}");
        assert!(dark.contains("text{fill:#e6e8eb}"), "{image}");
    }
}
