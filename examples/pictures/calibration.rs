//! Curves of all calibrations: D over its limit, over the closing of the pads from first contact.

use std::{fs, path::Path};

use softvt::{
    evaluation::{calibration::Envelope, safety::DeformationLimit, thresholds::ThresholdFile},
    media::{
        axis::Axis,
        chart::{Chart, ChartPoint, Curve, Layout, Margins, Mark, SINGLE_CURVE},
        drawing::Symbol,
    },
};

/// The image, from the root of the repository.
pub const IMAGE: &str = "docs/images/calibration.svg";
/// Folder of the calibrations.
pub const FOLDER: &str = "assets/calibration";
/// Ends of the axes: closing, mm, and D over τ, of which the second is D_ref for κ = 0.5.
const CLOSING_MM: f64 = 6.0;
const D_OVER_TAU: f64 = 3.0;
/// Panels with the same axes.
const PANELS: Layout = Layout {
    columns: 6,
    panel: [156.0, 132.0],
    margins: Margins { left: 0.0, top: 22.0, right: 14.0, bottom: 14.0 },
    shared: Some(Margins { left: 56.0, top: 8.0, right: 12.0, bottom: 30.0 }),
    unit: 1.045,
};

/// An asset with its calibration.
pub struct Calibrated {
    pub name: String,
    pub envelope: Envelope,
    pub limit: DeformationLimit,
}

impl Calibrated {
    /// Closing from first contact at which D reaches τ, mm.
    fn tight_mm(&self) -> f64 {
        self.envelope.window.tight.width_mm.map_or(f64::INFINITY, |width| self.closing_mm(width))
    }

    fn closing_mm(&self, width_mm: f64) -> f64 {
        self.envelope.width_contact_mm.unwrap_or(width_mm) - width_mm
    }

    fn panel(&self) -> Chart {
        let objection = self.envelope.exceeds_when_carried(self.limit).then_some("pressed only");
        let window = &self.envelope.window;
        let band = window.loose.width_mm.zip(window.tight.width_mm).map(|(loose, tight)| Mark::Band {
            from: self.closing_mm(loose),
            to: self.closing_mm(tight),
            objection,
        });
        let rows = self.envelope.sweep.iter().filter(|row| row.both_pads && row.d_pct.is_finite());
        let points = rows.map(|row| ChartPoint {
            x: self.closing_mm(row.width_mm),
            y: row.d_pct / self.limit.tau_pct(),
            symbol: Some(Symbol::DOT.with_radius(2.0).filled(row.stable)),
        });
        let points = within_the_axes(&points.collect::<Vec<_>>());
        let curve = Mark::Curve(Curve { points, stroke: Some(SINGLE_CURVE), ..Curve::default() });
        let level = Mark::Level { y: 1.0, label: String::new() };
        Chart {
            title: self.name.replace('_', " "),
            x: Axis::linear("closing from first contact, mm", 0.0, CLOSING_MM, 4).with_grid(),
            y: Axis::linear("D / τ", 0.0, D_OVER_TAU, 3),
            marks: band.into_iter().chain([level, curve]).collect(),
        }
    }
}

/// The points up to the ends of the axes, and the place at which the curve leaves them.
fn within_the_axes(points: &[ChartPoint]) -> Vec<ChartPoint> {
    let count = points.iter().take_while(|point| point.x <= CLOSING_MM && point.y <= D_OVER_TAU).count();
    let mut inside = points[..count].to_vec();
    if let (Some(last), Some(next)) = (inside.last().copied(), points.get(count)) {
        let share = |from: f64, to: f64, end: f64| if to > end { (end - from) / (to - from) } else { 1.0 };
        let cut = share(last.x, next.x, CLOSING_MM).min(share(last.y, next.y, D_OVER_TAU));
        let between = |from: f64, to: f64| from + cut * (to - from);
        inside.push(ChartPoint { x: between(last.x, next.x), y: between(last.y, next.y), symbol: None });
    }
    inside
}

/// The image, with the assets in the order of the closing that they bear.
pub fn svg(root: &Path) -> Result<String, String> {
    let mut all = calibrations(root)?;
    all.sort_by(|a, b| a.tight_mm().total_cmp(&b.tight_mm()).then_with(|| a.name.cmp(&b.name)));
    let label = "D over its limit, over the closing of the pads from first contact, for each soft asset";
    Ok(PANELS.svg(label, &all.iter().map(Calibrated::panel).collect::<Vec<_>>()))
}

/// All calibrations, in no order.
pub fn calibrations(root: &Path) -> Result<Vec<Calibrated>, String> {
    let folder = root.join(FOLDER);
    let entries = fs::read_dir(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let mut all = Vec::new();
    for path in entries.filter_map(Result::ok).map(|entry| entry.path()) {
        if path.extension().is_none_or(|end| end != "json") {
            continue;
        }
        let name = path.display().to_string();
        let text = fs::read_to_string(&path).map_err(|error| format!("{name}: {error}"))?;
        let file = ThresholdFile::parse(&text, &name).map_err(|error| error.to_string())?;
        for (asset, envelope) in &file.envelopes {
            let Some(limit) = file.limit(asset) else { continue };
            all.push(Calibrated { name: asset.clone(), envelope: envelope.clone(), limit });
        }
    }
    Ok(all)
}
