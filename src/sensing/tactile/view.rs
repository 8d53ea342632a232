//! The sensor's pinhole: where a point of the gel is in the picture.

use super::spec::{PICTURE, View};
use crate::{
    geometry::Vec3,
    robot::{PadSurface, Side, pads::pad_pose_in_finger},
};

impl View {
    /// Pixel (x, y) at which a point of the pad frame is seen, the same for both fingers: x right, along the pad's x
    /// (towards the hand); y down, along the pad's y. The picture spans 0..320 × 0..240; the apex is at (160, 120).
    ///
    /// A real camera behind the gel sees it like this; nothing is mirrored. As the pads face each other, the pictures of
    /// one thing held between them are mirror images of each other, up for down.
    pub fn pad_to_image(&self, p_p: &Vec3) -> [f64; 2] {
        let scale = self.lens / (self.lens + p_p.z) / self.pitch;
        [0.5 * PICTURE[0] as f64 + scale * p_p.x, 0.5 * PICTURE[1] as f64 + scale * p_p.y]
    }

    /// The same of a point in the frame of a finger's link.
    pub fn finger_to_image(&self, side: Side, p_finger: &Vec3) -> [f64; 2] {
        self.pad_to_image(&pad_pose_in_finger(side).inverse_transform_point(&(*p_finger).into()).coords)
    }

    /// The point of the untouched gel that is seen at pixel (x, y).
    pub fn image_to_pad(&self, pad: &PadSurface, px: [f64; 2]) -> Vec3 {
        let flat = [0, 1].map(|a| (px[a] - 0.5 * PICTURE[a] as f64) * self.pitch);
        let mut at = Vec3::new(flat[0], flat[1], 0.0);
        // The dome is shallow: each round is two orders nearer.
        for _ in 0..8 {
            at.z = pad.height(at.x, at.y);
            let scale = (self.lens + at.z) / self.lens;
            (at.x, at.y) = (flat[0] * scale, flat[1] * scale);
        }
        at
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_picture_shows_20_3_by_15_2_mm_with_the_hand_to_the_right() {
        let view = View::default();
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
    fn a_pixel_and_its_point_on_the_gel_belong_together() {
        let (view, pad) = (View::default(), PadSurface::default());
        for px in [[15.0, 26.0], [160.0, 120.0], [305.0, 214.0], [44.0, 190.0]] {
            let p = view.image_to_pad(&pad, px);
            assert!((p.z - pad.height(p.x, p.y)).abs() < 1e-12);
            let back = view.pad_to_image(&p);
            assert!((0..2).all(|a| (back[a] - px[a]).abs() < 1e-9), "{px:?} {back:?}");
        }
    }
}
