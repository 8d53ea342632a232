//! Labels at the ends of curves, which must not overlap.

use std::ops::{Add, Sub};

/// Moves places apart that are less than `gap` from each other, within `ends`: the least and the largest one. The
/// places are ascending, and stay so.
pub fn spread<T>(places: &mut [&mut T], gap: T, ends: [T; 2])
where
    T: Copy + PartialOrd + Add<Output = T> + Sub<Output = T>,
{
    let [mut least, mut most] = ends;
    for place in places.iter_mut() {
        if **place < least {
            **place = least;
        }
        least = **place + gap;
    }
    for place in places.iter_mut().rev() {
        if **place > most {
            **place = most;
        }
        most = **place - gap;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_keep_apart_within_the_plot() {
        let mut places = [3.0, 50.0, 50.0, 58.0];
        spread(&mut places.each_mut(), 10.0, [5.0, 60.0]);
        assert_eq!(places, [5.0, 40.0, 50.0, 60.0]);
    }
}
