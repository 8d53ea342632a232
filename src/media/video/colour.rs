//! RGB to Y'CbCr 4:2:0: ITU-R BT.601, studio range, as declared in the file and as players assume for small videos.

use rusty_h264_common::YuvFrame;

/// Fractional bits of the weights.
const BITS: i32 = 16;

/// BT.601 luma and chroma weights of R, G, B scaled to studio range (219 and 224 of 255), as fixed-point numbers.
const Y: [i32; 3] = [16829, 33039, 6416];
const CB: [i32; 3] = [-9714, -19071, 28784];
const CR: [i32; 3] = [28784, -24103, -4681];

fn weigh(weights: [i32; 3], [r, g, b]: [i32; 3], shift: i32) -> i32 {
    (weights[0] * r + weights[1] * g + weights[2] * b + (1 << (shift - 1))) >> shift
}

/// Converts `rgb` into `frame`; chroma is the mean of 2 × 2 pixels.
pub(super) fn to_yuv(rgb: &[u8], frame: &mut YuvFrame) {
    let width = frame.width;
    for (y, pixel) in frame.y.iter_mut().zip(rgb.as_chunks::<3>().0) {
        *y = (16 + weigh(Y, pixel.map(i32::from), BITS)) as u8;
    }
    let half = width / 2;
    let chroma = frame.u.chunks_exact_mut(half).zip(frame.v.chunks_exact_mut(half));
    for ((u, v), rows) in chroma.zip(rgb.chunks_exact(6 * width)) {
        let (upper, lower) = rows.split_at(3 * width);
        let blocks = upper.as_chunks::<6>().0.iter().zip(lower.as_chunks::<6>().0);
        for ((u, v), (a, b)) in u.iter_mut().zip(v).zip(blocks) {
            let sum = std::array::from_fn(|c| {
                i32::from(a[c]) + i32::from(a[c + 3]) + i32::from(b[c]) + i32::from(b[c + 3])
            });
            *u = (128 + weigh(CB, sum, BITS + 2)) as u8;
            *v = (128 + weigh(CR, sum, BITS + 2)) as u8;
        }
    }
}

#[cfg(test)]
pub(super) fn to_rgb(frame: &YuvFrame) -> Vec<u8> {
    let half = frame.width / 2;
    let pixel = |i: usize| {
        let at = i / frame.width / 2 * half + i % frame.width / 2;
        let y = (f64::from(frame.y[i]) - 16.0) / 219.0;
        let (cb, cr) = ((f64::from(frame.u[at]) - 128.0) / 224.0, (f64::from(frame.v[at]) - 128.0) / 224.0);
        let (r, b) = (y + 2.0 * (1.0 - 0.299) * cr, y + 2.0 * (1.0 - 0.114) * cb);
        [r, (y - 0.299 * r - 0.114 * b) / 0.587, b].map(|v| (255.0 * v).round().clamp(0.0, 255.0) as u8)
    };
    (0..frame.y.len()).flat_map(pixel).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flat_colours_come_back_within_two_levels() {
        for colour in [[0, 0, 0], [255, 255, 255], [255, 0, 0], [0, 255, 0], [0, 0, 255], [120, 80, 200]] {
            let mut frame = YuvFrame::black(16, 16);
            to_yuv(&colour.repeat(256), &mut frame);
            let back = to_rgb(&frame);
            for (got, sent) in back[..3].iter().zip(&colour) {
                assert!(got.abs_diff(*sent) <= 2, "{colour:?} became {:?}", &back[..3]);
            }
        }
    }
}
