//! The committed rows of `tests/reference/rows`.

use serde_json::Value;

use crate::support::{Body, Squeeze};

/// One line of a file of rows.
#[derive(Clone, Debug)]
pub struct Row(Value);

/// The rows of `group`.
pub fn rows(group: &str) -> Vec<Row> {
    let path = format!("{}/tests/reference/rows/{group}.jsonl", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{path}: {error}"));
    text.lines().map(|line| Row(serde_json::from_str(line).expect("a row of JSON"))).collect()
}

impl Row {
    /// A number; NaN in empty cells.
    pub fn number(&self, key: &str) -> f64 {
        self.0[key].as_f64().unwrap_or(f64::NAN)
    }

    pub fn text(&self, key: &str) -> &str {
        self.0[key].as_str().unwrap_or("")
    }

    pub fn flag(&self, key: &str) -> bool {
        self.0[key].as_bool().unwrap_or(false)
    }

    /// One of the two pad offsets, mm.
    pub fn offset_mm(&self, axis: usize) -> f64 {
        self.0["pad_offset_mm"][axis].as_f64().unwrap_or(0.0)
    }

    /// The squeeze that a reference row is of.
    pub fn squeeze(&self) -> Squeeze {
        let (radius, length) = (self.number("radius_m"), self.number("length_m"));
        Squeeze {
            body: match self.text("shape") {
                "sphere" => Body::Sphere { radius },
                "capsule" => Body::Capsule { radius, length },
                "cylinder" => Body::Cylinder { radius, length },
                _ => Body::Cube { size: self.number("size_m") },
            },
            resolution: self.number("resolution") as usize,
            youngs_pa: self.number("youngs_pa"),
            poisson: self.number("poisson"),
            density: self.number("density"),
            friction: self.number("friction"),
            pad: 1e-3 * self.number("pad_mm"),
            pad_offset: [0, 1].map(|axis| 1e-3 * self.offset_mm(axis)),
            gap: 1e-3 * self.number("gap_mm"),
            ..Squeeze::default()
        }
    }
}
