//! Curves of all calibrations: D over its limit, over the closing of the pads from first contact.

use std::{fs, path::Path};

use softvt::{
    evaluation::{calibration::Envelope, safety::DeformationLimit, thresholds::ThresholdFile},
    media::{
        multiples::{MultiplePanel, SmallMultiples},
        plot::{AxisBand, PlotPoint},
    },
};

/// The image, from the root of the repository.
pub const IMAGE: &str = "docs/images/calibration.svg";
/// Folder of the calibrations.
const FOLDER: &str = "assets/calibration";
/// Ends of the axes: closing, mm, and D over τ, of which the second is D_ref for κ = 0.5.
const CLOSING_MM: f64 = 6.0;
const D_OVER_TAU: f64 = 3.0;

/// An asset with its calibration.
struct Calibrated {
    name: String,
    envelope: Envelope,
    limit: DeformationLimit,
}

impl Calibrated {
    /// Closing from first contact at which D reaches τ, mm.
    fn tight_mm(&self) -> f64 {
        self.envelope.window.tight.width_mm.map_or(f64::INFINITY, |width| self.closing_mm(width))
    }

    fn closing_mm(&self, width_mm: f64) -> f64 {
        self.envelope.width_contact_mm.unwrap_or(width_mm) - width_mm
    }

    fn panel(&self) -> MultiplePanel {
        let objection = self.envelope.exceeds_when_carried(self.limit).then_some("pressed only");
        let window = &self.envelope.window;
        let band = window.loose.width_mm.zip(window.tight.width_mm).map(|(loose, tight)| AxisBand {
            left: self.closing_mm(loose),
            right: self.closing_mm(tight),
            objection,
        });
        let rows = self.envelope.sweep.iter().filter(|row| row.both_pads && row.d_pct.is_finite());
        let curve = rows.map(|row| PlotPoint {
            x: self.closing_mm(row.width_mm),
            y: row.d_pct / self.limit.tau_pct(),
            is_filled: row.stable,
        });
        MultiplePanel { title: self.name.replace('_', " "), band, curve: curve.collect() }
    }
}

/// The image, with the assets in the order of the closing that they bear.
///
/// # Errors
/// A calibration that cannot be read.
pub fn svg(root: &Path) -> Result<String, String> {
    let mut all = calibrations(root)?;
    all.sort_by(|a, b| a.tight_mm().total_cmp(&b.tight_mm()).then_with(|| a.name.cmp(&b.name)));
    let plots = SmallMultiples {
        title: "D over its limit, over the closing of the pads from first contact, for each soft asset"
            .to_owned(),
        x_label: "closing from first contact, mm".to_owned(),
        y_label: "D / τ".to_owned(),
        right: CLOSING_MM,
        top: D_OVER_TAU,
        level: 1.0,
        columns: 6,
        panels: all.iter().map(Calibrated::panel).collect(),
    };
    Ok(plots.svg())
}

fn calibrations(root: &Path) -> Result<Vec<Calibrated>, String> {
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
