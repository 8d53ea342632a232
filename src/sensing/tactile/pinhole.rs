//! Projection of the sensor's camera: from points on the gel to pixels and back.

use super::spec::{IMAGE_SIZE, Pinhole};
use crate::{
    geometry::Vec3,
    robot::{PadSurface, Side, pads::pad_pose_in_finger},
};

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

    /// Pixel (x, y) of a point in the frame of a finger's link, m.
    pub fn finger_to_image(&self, side: Side, p_finger: &Vec3) -> [f64; 2] {
        self.pad_to_image(&pad_pose_in_finger(side).inverse_transform_point(&(*p_finger).into()).coords)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_image_spans_20_3_by_15_2_mm_with_the_hand_to_the_right() {
        let view = Pinhole::default();
        assert_eq!(view.pad_to_image(&Vec3::zeros()), [160.0, 120.0]);
        assert!((view.pitch * 320.0 - 20.3e-3).abs() < 5e-5 && (view.pitch * 240.0 - 15.2e-3).abs() < 5e-5);
        for side in Side::BOTH {
            let apex = pad_pose_in_finger(side).translation.vector;
            // The finger's +z points to its tip, away from the hand; its +x is the hand's +x.
            let tip = view.finger_to_image(side, &(apex + Vec3::new(0.0, 0.0, 1e-3)));
            assert!((tip[0] - (160.0 - 1e-3 / view.pitch)).abs() < 1e-9 && (tip[1] - 120.0).abs() < 1e-9);
            let across = view.finger_to_image(side, &(apex + Vec3::new(1e-3, 0.0, 0.0)));
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
