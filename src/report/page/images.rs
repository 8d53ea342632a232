//! Stills that the page carries, and links to files beside it.

use std::{
    fs,
    io::Cursor,
    path::{Component, Path},
};

use data_encoding::BASE64;
use image::{
    ExtendedColorType, ImageEncoder, ImageFormat, ImageReader, Limits,
    codecs::png::{CompressionType, FilterType, PngEncoder},
    imageops,
};

/// Width of a still in the page, pixels.
const WIDTH: u32 = 480;
/// Edges of the largest picture that is read, pixels.
const LARGEST: u32 = 4096;

/// Bytes of pictures that a page may still carry.
#[derive(Debug)]
pub(super) struct Room(pub usize);

/// A PNG file as an address that holds it, made smaller if it is wide, with its width and height; `None` if there is none,
/// if it is no picture, or if the page carries enough already.
pub(super) fn embedded(path: &Path, room: &mut Room) -> Option<(String, [u32; 2])> {
    let bytes = fs::read(path).ok()?;
    let mut reader = ImageReader::with_format(Cursor::new(bytes), ImageFormat::Png);
    let mut limits = Limits::default();
    (limits.max_image_width, limits.max_image_height) = (Some(LARGEST), Some(LARGEST));
    reader.limits(limits);
    let picture = reader.decode().ok()?.into_rgb8();
    let (width, height) = picture.dimensions();
    let small = match width > WIDTH {
        true => imageops::resize(
            &picture,
            WIDTH,
            (height * WIDTH / width).max(1),
            imageops::FilterType::CatmullRom,
        ),
        false => picture,
    };
    let (width, height) = small.dimensions();
    let mut png = Vec::new();
    PngEncoder::new_with_quality(&mut png, CompressionType::Best, FilterType::Adaptive)
        .write_image(&small, width, height, ExtendedColorType::Rgb8)
        .ok()?;
    room.0 = room.0.checked_sub(png.len())?;
    Some((format!("data:image/png;base64,{}", BASE64.encode(&png)), [width, height]))
}

/// The address of a file as a page in the folder `from` names it; both exist.
pub(super) fn link(from: &Path, file: &Path) -> Option<String> {
    let (from, file) = (from.canonicalize().ok()?, file.canonicalize().ok()?);
    let (from, file): (Vec<Component>, Vec<Component>) =
        (from.components().collect(), file.components().collect());
    let same = from.iter().zip(&file).take_while(|(a, b)| a == b).count();
    let up = std::iter::repeat_n("..".to_owned(), from.len() - same);
    let down = file[same..].iter().map(|part| escaped(&part.as_os_str().to_string_lossy()));
    Some(up.chain(down).collect::<Vec<_>>().join("/"))
}

/// A part of an address (RFC 3986): what is not unreserved is escaped.
fn escaped(part: &str) -> String {
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"-_.~".contains(&byte);
    part.bytes()
        .map(|byte| if plain(byte) { char::from(byte).to_string() } else { format!("%{byte:02X}") })
        .collect()
}

#[cfg(test)]
mod tests {
    use image::{Rgb, RgbImage};

    use super::*;

    #[test]
    fn a_still_is_made_small_and_a_page_carries_only_so_many_bytes() {
        let root = tempfile::tempdir().unwrap();
        let path = root.path().join("still.png");
        RgbImage::from_fn(1024, 1056, |x, y| Rgb([x as u8, y as u8, 9])).save(&path).unwrap();
        let mut room = Room(1 << 20);
        let (address, size) = embedded(&path, &mut room).unwrap();
        assert_eq!(size, [480, 495]);
        let bytes =
            BASE64.decode(address.strip_prefix("data:image/png;base64,").unwrap().as_bytes()).unwrap();
        assert_eq!(room.0 + bytes.len(), 1 << 20);
        assert!(embedded(&path, &mut Room(bytes.len() - 1)).is_none());
        fs::write(&path, b"\x89PNG but no picture").unwrap();
        assert!(
            embedded(&path, &mut room).is_none() && embedded(&root.path().join("none"), &mut room).is_none()
        );
    }

    #[test]
    fn a_link_leads_from_the_page_to_the_file_whatever_its_name() {
        let root = tempfile::tempdir().unwrap();
        let (page, run) = (root.path().join("out/page"), root.path().join("a \"run\" <1>"));
        fs::create_dir_all(&page).unwrap();
        fs::create_dir_all(&run).unwrap();
        fs::write(run.join("é.mp4"), b"").unwrap();
        assert_eq!(link(&page, &run.join("é.mp4")).unwrap(), "../../a%20%22run%22%20%3C1%3E/%C3%A9.mp4");
        assert_eq!(link(&run, &run.join("é.mp4")).unwrap(), "%C3%A9.mp4");
        assert_eq!(link(&page, &run.join("none")), None);
    }
}
