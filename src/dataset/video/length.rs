//! How long a video of ours is, from its index.

/// Pictures and pictures a second of an MP4 file with one track; none if it is none, or cut off.
pub fn length(file: &[u8]) -> Option<(usize, f64)> {
    let media = inside(inside(inside(file, b"moov")?, b"trak")?, b"mdia")?;
    let table = inside(inside(media, b"minf")?, b"stbl")?;
    let frames = number(inside(table, b"stsz")?, 8)? as usize;
    let header = inside(media, b"mdhd")?;
    let (scale, duration) = (number(header, 12)?, number(header, 16)?);
    // Pictures that were cut off are missed here.
    let pictures = inside(file, b"mdat")?.len();
    let sizes = inside(table, b"stsz")?.get(12..)?.as_chunks::<4>().0;
    let expected: usize = sizes.iter().map(|size| u32::from_be_bytes(*size) as usize).sum();
    let whole = sizes.len() == frames && expected == pictures && duration > 0;
    whole.then(|| (frames, f64::from(scale) * frames as f64 / f64::from(duration)))
}

/// The payload of the first box of a name.
fn inside<'a>(mut boxes: &'a [u8], name: &[u8; 4]) -> Option<&'a [u8]> {
    loop {
        let size = number(boxes, 0)? as usize;
        let whole = boxes.get(..size).filter(|_| size >= 8)?;
        if &whole[4..8] == name {
            return whole.get(8..);
        }
        boxes = &boxes[size..];
    }
}

fn number(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_be_bytes(bytes.get(at..at + 4)?.try_into().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::video::VideoWriter;

    #[test]
    fn the_index_tells_the_length_and_a_cut_file_has_none() {
        let mut video = VideoWriter::new(32, 48, 20).unwrap();
        (0..7).for_each(|shade| video.push(&vec![30 * shade; 32 * 48 * 3]).unwrap());
        let file = video.finish().unwrap();
        assert_eq!(length(&file), Some((7, 20.0)));
        assert_eq!(length(&file[..file.len() - 1]), None);
        assert_eq!(length(&file[..100]), None);
        assert_eq!(length(b"hello"), None);
    }
}
