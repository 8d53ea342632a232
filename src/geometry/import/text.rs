//! Lines of text files of any encoding.

use std::borrow::Cow;

/// Byte order mark, with which some editors begin a file.
const BYTE_ORDER_MARK: char = '\u{feff}';

/// True if bytes begin with the byte order mark of UTF-16.
pub(super) fn is_utf16(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff])
}

/// The text of a file: UTF-8, UTF-16 with a byte order mark, or else Latin-1, with lines that end in `\n`.
///
/// # Errors
/// Characters of UTF-16 that do not exist, or NUL; the message states the line.
pub(super) fn decoded(bytes: &[u8]) -> Result<String, String> {
    let text = match bytes {
        _ if is_utf16(bytes) => {
            let unit = if bytes[0] == 0xff { u16::from_le_bytes } else { u16::from_be_bytes };
            let units = bytes.as_chunks().0.iter().map(|pair| unit(*pair));
            Cow::from(char::decode_utf16(units).map(|c| c.unwrap_or('\0')).collect::<String>())
        }
        _ => match str::from_utf8(bytes) {
            Ok(text) => Cow::from(text),
            Err(_) => bytes.iter().map(|byte| char::from(*byte)).collect::<String>().into(),
        },
    };
    let text = text.trim_start_matches(BYTE_ORDER_MARK).replace("\r\n", "\n").replace('\r', "\n");
    match text.lines().position(|line| line.contains('\0')) {
        Some(at) => Err(format!(
            "line {} has a character that is not text: it may be UTF-16 without a byte order mark, or damaged; save it as UTF-8",
            at + 1
        )),
        None => Ok(text),
    }
}

/// The lines of a text without their surrounding white space, and their numbers. A line that ends in a backslash goes
/// on in the next one, unless it is a comment.
pub(super) fn numbered_lines(text: &str) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    let mut lines = text.lines().map(str::trim).zip(1..);
    std::iter::from_fn(move || {
        let (first, number) = lines.next()?;
        let mut line = Cow::from(first);
        while line.ends_with('\\') && !line.starts_with('#') {
            let line = line.to_mut();
            line.pop();
            line.push(' ');
            line.push_str(lines.next().map_or("", |(next, _)| next));
        }
        Some((number, line))
    })
}
