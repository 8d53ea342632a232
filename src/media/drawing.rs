//! Elements of charts and pictures: lines, areas, texts and symbols, each with a style that [`svg`](super::svg)
//! and [`canvas`](super::canvas) show in the colours of [`palette`](super::palette).

/// A place in an image, px.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    pub x: f32,
    pub y: f32,
}

pub fn at(x: f32, y: f32) -> Place {
    Place { x, y }
}

/// A rectangle in an image by its edges, px.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Area {
    pub left: f32,
    pub top: f32,
    pub right: f32,
    pub bottom: f32,
}

impl Area {
    pub fn width(&self) -> f32 {
        self.right - self.left
    }

    pub fn height(&self) -> f32 {
        self.bottom - self.top
    }
}

/// End of a text at its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    Start,
    Middle,
    End,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tone {
    Ink,
    Faint,
    /// Safe, and the curve of a chart with one curve.
    Safe,
    Harm,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stroke {
    Axis,
    Grid,
    /// A limit, dashed in SVG.
    Limit,
    /// A vertical line at a value.
    Guide,
    /// A vertical line at an event.
    Event,
    /// An interval of a value.
    Whisker,
    /// The gap between a rate and a smaller one.
    Gap,
    /// A curve, with the dashes of its number.
    Curve {
        tone: Tone,
        dash: usize,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fill {
    Band,
    /// A range of values that does not hold what it seems to.
    Hatched,
    Bar,
    Harm,
    Interval,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Font {
    Plain(Tone),
    /// A name next to a drawing, as large as a title.
    Name(Tone),
    Title,
    Strong,
    /// From bottom to top, in SVG.
    Upward,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Symbol {
    pub shape: Shape,
    /// Distance of its outline from the point, px.
    pub radius: f32,
    pub tone: Tone,
    /// False for the outline alone.
    pub is_filled: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    Circle,
    /// A square on its corner.
    Diamond,
}

impl Symbol {
    pub const DOT: Self = Self { shape: Shape::Circle, radius: 3.0, tone: Tone::Safe, is_filled: true };
    pub const RING: Self = Self { is_filled: false, ..Self::DOT };
    pub const DIAMOND: Self = Self { shape: Shape::Diamond, radius: 4.0, tone: Tone::Ink, is_filled: true };
    pub const OPEN_DIAMOND: Self = Self { is_filled: false, ..Self::DIAMOND };

    pub const fn with_radius(self, radius: f32) -> Self {
        Self { radius, ..self }
    }

    pub fn filled(self, is_filled: bool) -> Self {
        Self { is_filled, ..self }
    }
}

/// An element of a drawing. Later ones cover earlier ones.
#[derive(Clone, Debug, PartialEq)]
pub enum Element {
    Line(Vec<Place>, Stroke),
    Area(Area, Fill),
    Symbol(Place, Symbol),
    Text {
        /// Its baseline at the anchor.
        place: Place,
        /// Distance to the right of the place, px.
        shift: f32,
        anchor: Anchor,
        font: Font,
        text: String,
    },
    /// A text on ground of its own that ends at `right` at the latest.
    Tag {
        place: Place,
        /// Distance to the right of the place, px.
        shift: f32,
        right: f32,
        text: String,
    },
}

pub fn line(from: Place, to: Place, stroke: Stroke) -> Element {
    Element::Line(vec![from, to], stroke)
}

pub fn text(place: Place, anchor: Anchor, text: impl Into<String>) -> Element {
    styled_text(place, anchor, Font::Plain(Tone::Ink), text)
}

pub fn styled_text(place: Place, anchor: Anchor, font: Font, text: impl Into<String>) -> Element {
    Element::Text { place, shift: 0.0, anchor, font, text: text.into() }
}

impl Element {
    /// The element farther to the right, px.
    pub fn shifted(mut self, by: f32) -> Self {
        match &mut self {
            Self::Text { shift, .. } | Self::Tag { shift, .. } => *shift += by,
            Self::Line(places, _) => places.iter_mut().for_each(|place| place.x += by),
            Self::Symbol(place, _) => place.x += by,
            Self::Area(area, _) => (area.left, area.right) = (area.left + by, area.right + by),
        }
        self
    }
}
