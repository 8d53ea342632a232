//! What charts and pictures are drawn of: lines, areas, texts and symbols, each with a style that [`svg`](super::svg)
//! and [`canvas`](super::canvas) show in the colours of [`palette`](super::palette).

/// A place in an image, px.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// From the left.
    pub x: f32,
    /// From the top.
    pub y: f32,
}

/// Short for a place.
pub fn at(x: f32, y: f32) -> Place {
    Place { x, y }
}

/// A rectangle in an image by its edges, px.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Area {
    /// Left edge.
    pub left: f32,
    /// Upper edge.
    pub top: f32,
    /// Right edge.
    pub right: f32,
    /// Lower edge.
    pub bottom: f32,
}

impl Area {
    /// Distance of the left and right edges.
    pub fn width(&self) -> f32 {
        self.right - self.left
    }

    /// Distance of the upper and lower edges.
    pub fn height(&self) -> f32 {
        self.bottom - self.top
    }
}

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

/// Colour of the palette.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tone {
    /// Text and axes.
    Ink,
    /// Beside the main marks.
    Faint,
    /// Safe, and the curve of a chart with one curve.
    Safe,
    /// Over the limit.
    Harm,
}

/// Style of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stroke {
    /// An axis or one of its ticks.
    Axis,
    /// A grid line.
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
        /// Its colour.
        tone: Tone,
        /// Number of the curve in its chart.
        dash: usize,
    },
}

/// Style of an area.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fill {
    /// A range of values.
    Band,
    /// A range of values that does not hold what it seems to.
    Hatched,
    /// A bar of a histogram.
    Bar,
    /// Values over a limit.
    Harm,
    /// An interval of values.
    Interval,
}

/// Style of a text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Font {
    /// In a colour.
    Plain(Tone),
    /// A name beside a drawing, as large as a title.
    Name(Tone),
    /// A title.
    Title,
    /// An objection.
    Strong,
    /// From bottom to top, in SVG.
    Upward,
}

/// A mark of a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Symbol {
    /// Its outline.
    pub shape: Shape,
    /// Distance of its outline from the point, px.
    pub radius: f32,
    /// Its colour.
    pub tone: Tone,
    /// False for the outline alone.
    pub is_filled: bool,
}

/// Outline of a symbol.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// A circle.
    Circle,
    /// A square on its corner.
    Diamond,
}

impl Symbol {
    /// A filled circle.
    pub const DOT: Self = Self { shape: Shape::Circle, radius: 3.0, tone: Tone::Safe, is_filled: true };
    /// The outline of a circle.
    pub const RING: Self = Self { is_filled: false, ..Self::DOT };
    /// A filled diamond.
    pub const DIAMOND: Self = Self { shape: Shape::Diamond, radius: 4.0, tone: Tone::Ink, is_filled: true };
    /// The outline of a diamond.
    pub const OPEN_DIAMOND: Self = Self { is_filled: false, ..Self::DIAMOND };

    /// The same symbol with another radius, px.
    pub const fn with_radius(self, radius: f32) -> Self {
        Self { radius, ..self }
    }

    /// The symbol, or its outline.
    pub fn filled(self, is_filled: bool) -> Self {
        Self { is_filled, ..self }
    }
}

/// An element of a drawing. Later ones cover earlier ones.
#[derive(Clone, Debug, PartialEq)]
pub enum Element {
    /// A line through places.
    Line(Vec<Place>, Stroke),
    /// A filled area.
    Area(Area, Fill),
    /// A symbol at a place.
    Symbol(Place, Symbol),
    /// A text.
    Text {
        /// Its baseline at the anchor.
        place: Place,
        /// Distance to the right of the place, px.
        shift: f32,
        /// Its end at the place.
        anchor: Anchor,
        /// Its style.
        font: Font,
        /// Its words.
        text: String,
    },
    /// A text on ground of its own that ends at `right` at the latest.
    Tag {
        /// Upper left corner.
        place: Place,
        /// Distance to the right of the place, px.
        shift: f32,
        /// Right end, px.
        right: f32,
        /// Its words.
        text: String,
    },
}

/// A line between two places.
pub fn line(from: Place, to: Place, stroke: Stroke) -> Element {
    Element::Line(vec![from, to], stroke)
}

/// A text in the colour of axes.
pub fn text(place: Place, anchor: Anchor, text: impl Into<String>) -> Element {
    styled_text(place, anchor, Font::Plain(Tone::Ink), text)
}

/// A text with a style.
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
