//! Images embedded in the page, and links to files next to it.

use std::{
    fs,
    io::Cursor,
    path::{Component, Path},
};

use data_encoding::BASE64;
use image::{ImageFormat, ImageReader, Limits, RgbImage, imageops::crop_imm};

use crate::video::{STILL_SIZE, TARGET_PANEL};
use softvt_media::jpeg::encode_jpeg;
use softvt_sensing::camera::resize;

/// Largest width of an embedded image, pixels.
const MAX_WIDTH: u32 = 320;
/// Quality of embedded images, 1 to 100.
const JPEG_QUALITY: u8 = 80;
/// Largest width and height of an image that is read, pixels.
const MAX_INPUT_EDGE: u32 = 4096;

/// Bytes of images that may still be embedded.
#[derive(Debug)]
pub(super) struct ByteBudget(pub usize);

/// An image as a `data:` URL.
#[derive(Debug)]
pub(super) struct DataImage {
    pub url: String,
    pub width: u32,
    pub height: u32,
}

/// Reads a PNG file, of a still of an episode the panel that shows the target from nearby, scaled down to the largest
/// width. `None` if it is missing, not an image, or exceeds the budget.
pub(super) fn embed_image(path: &Path, budget: &mut ByteBudget) -> Option<DataImage> {
    let bytes = fs::read(path).ok()?;
    let mut reader = ImageReader::with_format(Cursor::new(bytes), ImageFormat::Png);
    let mut limits = Limits::default();
    (limits.max_image_width, limits.max_image_height) = (Some(MAX_INPUT_EDGE), Some(MAX_INPUT_EDGE));
    reader.limits(limits);
    let mut image = reader.decode().ok()?.into_rgb8();
    if <[u32; 2]>::from(image.dimensions()) == STILL_SIZE {
        let [left, top, edge] = TARGET_PANEL;
        image = crop_imm(&image, left, top, edge, edge).to_image();
    }
    let (width, height) = image.dimensions();
    let small = match width > MAX_WIDTH {
        true => resize(&image, MAX_WIDTH, (height * MAX_WIDTH / width).max(1)),
        false => image,
    };
    embed(&small, budget)
}

/// An image as it is. `None` if it exceeds the budget.
pub(super) fn embed(image: &RgbImage, budget: &mut ByteBudget) -> Option<DataImage> {
    let (width, height) = image.dimensions();
    let jpeg = encode_jpeg(image, JPEG_QUALITY)?;
    budget.0 = budget.0.checked_sub(jpeg.len())?;
    let url = format!("data:image/jpeg;base64,{}", BASE64.encode(&jpeg));
    Some(DataImage { url, width, height })
}

/// Relative URL of a file from a page in the folder `from`; `None` if either is missing.
pub(super) fn relative_link(from: &Path, file: &Path) -> Option<String> {
    let (from, file) = (from.canonicalize().ok()?, file.canonicalize().ok()?);
    let (from, file): (Vec<Component>, Vec<Component>) =
        (from.components().collect(), file.components().collect());
    let same = from.iter().zip(&file).take_while(|(a, b)| a == b).count();
    let up = std::iter::repeat_n("..".to_owned(), from.len() - same);
    let down = file[same..].iter().map(|part| percent_encode(&part.as_os_str().to_string_lossy()));
    Some(up.chain(down).collect::<Vec<_>>().join("/"))
}

/// Percent-encodes a path segment of a URL (RFC 3986).
fn percent_encode(part: &str) -> String {
    let is_unreserved = |byte: u8| byte.is_ascii_alphanumeric() || b"-_.~".contains(&byte);
    part.bytes()
        .map(|byte| if is_unreserved(byte) { char::from(byte).to_string() } else { format!("%{byte:02X}") })
        .collect()
}

#[cfg(test)]
mod tests {
    use image::Rgb;

    use super::*;

    #[test]
    fn images_are_scaled_down_and_limited_by_the_budget() {
        let root = tempfile::tempdir().unwrap();
        let path = root.path().join("still.png");
        RgbImage::from_fn(1024, 512, |x, y| Rgb([x as u8, y as u8, 9])).save(&path).unwrap();
        let mut budget = ByteBudget(1 << 20);
        let DataImage { url: address, width, height } = embed_image(&path, &mut budget).unwrap();
        assert_eq!([width, height], [320, 160]);
        let bytes =
            BASE64.decode(address.strip_prefix("data:image/jpeg;base64,").unwrap().as_bytes()).unwrap();
        assert_eq!(budget.0 + bytes.len(), 1 << 20);
        assert!(embed_image(&path, &mut ByteBudget(bytes.len() - 1)).is_none());
        RgbImage::new(STILL_SIZE[0], STILL_SIZE[1]).save(&path).unwrap();
        let panel = embed_image(&path, &mut budget).unwrap();
        assert_eq!([panel.width, panel.height], [320, 320], "the target from nearby");
        fs::write(&path, b"\x89PNG but no image").unwrap();
        assert!(
            embed_image(&path, &mut budget).is_none()
                && embed_image(&root.path().join("none"), &mut budget).is_none()
        );
    }

    #[test]
    fn links_lead_from_the_page_to_files_of_any_name() {
        let root = tempfile::tempdir().unwrap();
        let (page, run) = (root.path().join("out/page"), root.path().join("a \"run\" <1>"));
        fs::create_dir_all(&page).unwrap();
        fs::create_dir_all(&run).unwrap();
        fs::write(run.join("é.mp4"), b"").unwrap();
        assert_eq!(
            relative_link(&page, &run.join("é.mp4")).unwrap(),
            "../../a%20%22run%22%20%3C1%3E/%C3%A9.mp4"
        );
        assert_eq!(relative_link(&run, &run.join("é.mp4")).unwrap(), "%C3%A9.mp4");
        assert_eq!(relative_link(&page, &run.join("none")), None);
    }
}
