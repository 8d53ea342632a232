//! Parameters of the tactile sensors at the finger tips (settings `tactile.*`), and the view of their cameras.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::PadSurface;
use softvt_common::{
    range::{Range, RangeError},
    settings::{SettingDeclaration, SettingField, SettingValue, SettingVisitor},
};
use softvt_geometry::Vec3;
use softvt_physics::contact::LayerMaterial;

/// Width and height of a tactile image, px.
pub const IMAGE_SIZE: [usize; 2] = [320, 240];

softvt_common::settings! {
    /// Parameters of a tactile sensor; the default is the GelSight Mini of the benchmark.
    pub struct TactileSpec {
        /// Material of the gel and the grid on which it is solved.
        gel: GelSpec;
        /// View of the camera.
        view: Pinhole;
        /// Model of the colour image.
        optics: OpticsModel;
        /// True to draw cast shadows; with the `polynomial` optics only.
        shadows: bool = false;
        /// Model of the marker motion.
        markers: MarkerModel;
        /// Noise and wear of both sensors.
        wear: WearSpec;
    }
}

softvt_common::settings! {
    /// Noise and wear of a tactile sensor: what a policy observes of it. The forces of the contact are unchanged.
    #[derive(Copy)]
    pub struct WearSpec {
        /// Standard deviation of the noise of each marker coordinate in each image.
        noise_px: f64 = 0.0, "px", Range::closed(0.0, 20.0);
        /// Standard deviation of the constant offset of each marker coordinate.
        offset_px: f64 = 0.0, "px", Range::closed(0.0, 20.0);
        /// Factor on the displacements of the markers and on the changes of the image.
        gain: f64 = 1.0, "", Range::closed(0.0, 10.0);
        /// Share of the markers that do not follow the gel.
        dead_share: f64 = 0.0, "", Range::closed(0.0, 1.0);
        /// Standard deviation of the noise of each colour value (0 to 255) in each image.
        image_noise: f64 = 0.0, "of 255", Range::closed(0.0, 128.0);
    }
}

softvt_common::settings! {
    /// Material of the gel, for the contact of the pads and for the images, and grid of the images. Its shape is
    /// [`PadSurface`].
    #[derive(Copy)]
    pub struct GelSpec {
        /// Shear modulus. 0.145 MPa: twice the C10 identified on a GelSight Mini (Helmut et al., arXiv 2411.03315).
        shear_modulus: f64 = 1.45e5, "Pa", Range::closed(1e4, 1e9);
        /// Poisson's ratio.
        poisson: f64 = 0.475, "", Range::closed(0.0, 0.499);
        /// Edge of a grid cell.
        cell: f64 = 4e-4, "m", Range::closed(1e-4, 5e-4);
    }
}

softvt_common::settings! {
    /// Camera of the sensor: a pinhole behind the apex of the gel that looks out along the pad's +z. Image x (right) is
    /// the pad's x, image y (down) the pad's y; `docs/tactile.md` draws the frames.
    #[derive(Copy)]
    pub struct Pinhole {
        /// Edge of a pixel on the plane of the apex. 0.0634 mm at 320×240 (GelSight's own figure).
        pitch: f64 = 6.34e-5, "m", Range::closed(1e-5, 2e-4);
        /// Distance of the pinhole from the apex.
        lens: f64 = 2.6e-2, "m", Range::closed(5e-3, 1.0);
    }
}

impl GelSpec {
    /// The gel of a pad as an elastic layer.
    pub fn layer(&self, pad: &PadSurface) -> LayerMaterial {
        LayerMaterial { shear_modulus: self.shear_modulus, poisson: self.poisson, thickness: pad.thickness }
    }
}

impl Pinhole {
    /// Pixel (x, y) of a point in the pad frame (m), the same for both fingers: x right, along the pad's x (towards
    /// the hand); y down, along the pad's y. The image spans 0..320 × 0..240; the apex is at (160, 120).
    ///
    /// This is the view of a real camera behind the gel; nothing is mirrored. Since the pads face each other, the
    /// images of one object held between them are mirrored top to bottom.
    pub fn pad_to_image(&self, p_p: &Vec3) -> [f64; 2] {
        let scale = self.lens / (self.lens + p_p.z) / self.pitch;
        [0.5 * IMAGE_SIZE[0] as f64 + scale * p_p.x, 0.5 * IMAGE_SIZE[1] as f64 + scale * p_p.y]
    }

    /// Position along an axis of the centre of pixel `p`, m on the plane of the apex.
    pub fn pixel_centre(&self, axis: usize, p: usize) -> f64 {
        (p as f64 + 0.5 - 0.5 * IMAGE_SIZE[axis] as f64) * self.pitch
    }

    /// Point of the undeformed gel at a pixel (x, y), m, pad frame.
    pub fn image_to_pad(&self, pad: &PadSurface, px: [f64; 2]) -> Vec3 {
        let on_apex_plane = [0, 1].map(|a| (px[a] - 0.5 * IMAGE_SIZE[a] as f64) * self.pitch);
        let mut at = Vec3::new(on_apex_plane[0], on_apex_plane[1], 0.0);
        // Fixed-point iteration: the dome is shallow, so each round gains two orders of magnitude.
        for _ in 0..8 {
            at.z = pad.height(at.x, at.y);
            let scale = (self.lens + at.z) / self.lens;
            (at.x, at.y) = (on_apex_plane[0] * scale, on_apex_plane[1] * scale);
        }
        at
    }
}

/// Model of the colour image.
///
/// Models without parameters have braces, since serde ignores unknown fields of unit variants.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "model", rename_all = "snake_case", deny_unknown_fields)]
pub enum OpticsModel {
    /// Polynomial of the surface's slope, fitted to a real GelSight Mini.
    Polynomial {},
    /// Pipeline of Taxim (Si & Yuan, RA-L 2022) with calibration tables of the user.
    Taxim {
        /// Folder with `polycalib.npz` and `dataPack.npz`.
        tables: PathBuf,
    },
}

/// Model of the marker motion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "model", rename_all = "snake_case", deny_unknown_fields)]
pub enum MarkerModel {
    /// Markers move with the surface of the gel and are seen through the pinhole.
    Elastic {},
    /// Markers move by the law of FOTS (Zhao et al., arXiv 2404.19217).
    Fots(FotsSpec),
}

softvt_common::settings! {
    /// Constants of the marker law of FOTS.
    #[derive(Copy)]
    pub struct FotsSpec {
        /// Decay of the dilation.
        dilate: f64 = 0.00125, "1/px²", Range::closed(0.0, 1.0);
        /// Decay of the shear.
        shear: f64 = 0.00021, "1/px²", Range::closed(0.0, 1.0);
        /// Decay of the twist.
        twist: f64 = 0.00038, "1/px²", Range::closed(0.0, 1.0);
        /// Scale of the image, pixels per millimetre.
        scale: f64 = 19.58, "px/mm", Range::closed(1.0, 1000.0);
        /// Factor on the depths in mm: 1 in FOTS, 0.1 in the port that SoftVTBench uses.
        height_factor: f64 = 0.1, "", Range::closed(0.0, 100.0);
    }
}

impl TactileSpec {
    /// Checks the range of every parameter.
    ///
    /// # Errors
    /// Names the first parameter out of its range, its value and the range.
    pub fn validate(&self) -> Result<(), RangeError> {
        self.check("tactile")?;
        if self.shadows && self.optics != OpticsModel::default() {
            let expected = "false with the model \"taxim\", whose images have no shadows";
            let (path, value) = ("tactile.shadows".into(), "true".into());
            return Err(RangeError { path, expected: expected.into(), value });
        }
        Ok(())
    }
}

impl Default for OpticsModel {
    fn default() -> Self {
        Self::Polynomial {}
    }
}

impl Default for MarkerModel {
    fn default() -> Self {
        Self::Elastic {}
    }
}

impl SettingField for OpticsModel {
    fn visit(&self, declaration: &SettingDeclaration<'_>, visitor: &mut SettingVisitor<'_>) {
        let values = "polynomial, or { model = \"taxim\", tables = folder }";
        visitor(declaration, SettingValue::Word { value: "polynomial", values });
    }
}

impl SettingField for MarkerModel {
    fn visit(&self, declaration: &SettingDeclaration<'_>, visitor: &mut SettingVisitor<'_>) {
        let values = "elastic, or fots with the constants below";
        visitor(declaration, SettingValue::Word { value: "elastic", values });
        match self {
            Self::Elastic {} => FotsSpec::default().visit(declaration, visitor),
            Self::Fots(fots) => fots.visit(declaration, visitor),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Side, pads::pad_pose_in_finger};

    #[test]
    fn defaults_are_valid_and_bad_numbers_are_named() {
        TactileSpec::default().validate().expect("defaults");
        let mut spec = TactileSpec::default();
        spec.view.pitch = f64::NAN;
        let message = spec.validate().expect_err("NaN").to_string();
        assert_eq!(message, "tactile.view.pitch: expected a number in 0.00001..0.0002 (m), got NaN");
        let optics = OpticsModel::Taxim { tables: "x".into() };
        let spec = TactileSpec { shadows: true, optics, ..TactileSpec::default() };
        let message = spec.validate().expect_err("shadows of Taxim").to_string();
        assert!(message.starts_with("tactile.shadows: expected false with the model \"taxim\""), "{message}");
    }

    #[test]
    fn models_are_selected_by_name() {
        let text = r#"{ "optics": { "model": "taxim", "tables": "x" }, "markers": { "model": "fots", "scale": 15.77 } }"#;
        let spec: TactileSpec = serde_json::from_str(text).expect("valid");
        assert_eq!(spec.optics, OpticsModel::Taxim { tables: "x".into() });
        assert_eq!(spec.markers, MarkerModel::Fots(FotsSpec { scale: 15.77, ..FotsSpec::default() }));
        let unknown = serde_json::from_str::<TactileSpec>(r#"{ "optics": { "model": "photon" } }"#);
        assert!(unknown.expect_err("unknown model").to_string().contains("photon"));
        for idle in [
            r#"{ "markers": { "model": "elastic", "dilate": 1 } }"#,
            r#"{ "optics": { "model": "polynomial", "x": 1 } }"#,
        ] {
            let message = serde_json::from_str::<TactileSpec>(idle).expect_err(idle).to_string();
            assert!(message.contains("unknown field"), "{message}");
        }
    }

    #[test]
    fn the_image_spans_20_3_by_15_2_mm_with_the_hand_to_the_right() {
        let view = Pinhole::default();
        assert_eq!(view.pad_to_image(&Vec3::zeros()), [160.0, 120.0]);
        assert!((view.pitch * 320.0 - 20.3e-3).abs() < 5e-5 && (view.pitch * 240.0 - 15.2e-3).abs() < 5e-5);
        for side in Side::BOTH {
            let pad = pad_pose_in_finger(side);
            let apex = pad.translation.vector;
            let project =
                |p_finger: Vec3| view.pad_to_image(&pad.inverse_transform_point(&p_finger.into()).coords);
            // The finger's +z points to its tip, away from the hand; its +x is the hand's +x.
            let tip = project(apex + Vec3::new(0.0, 0.0, 1e-3));
            assert!((tip[0] - (160.0 - 1e-3 / view.pitch)).abs() < 1e-9 && (tip[1] - 120.0).abs() < 1e-9);
            let across = project(apex + Vec3::new(1e-3, 0.0, 0.0));
            let down = if side == Side::Left { 1.0 } else { -1.0 };
            assert!((across[1] - (120.0 + down * 1e-3 / view.pitch)).abs() < 1e-9);
        }
    }

    #[test]
    fn projection_and_back_projection_are_inverse() {
        let (view, pad) = (Pinhole::default(), PadSurface::default());
        for px in [[15.0, 26.0], [160.0, 120.0], [305.0, 214.0], [44.0, 190.0]] {
            let p = view.image_to_pad(&pad, px);
            assert!((p.z - pad.height(p.x, p.y)).abs() < 1e-12);
            let back = view.pad_to_image(&p);
            assert!((0..2).all(|a| (back[a] - px[a]).abs() < 1e-9), "{px:?} {back:?}");
        }
    }
}
