//! Messages to a page: a JSON object and arrays of numbers or bytes that it refers to by index.
//!
//! In bytes: the length of the JSON text (u32, little-endian), the text, padded with spaces to a multiple of four
//! bytes, then the arrays, each padded with zeros likewise. The field `blobs` of the object has their lengths in
//! bytes.

use serde_json::{Value, json};

#[derive(Debug, Default)]
pub(crate) struct Message {
    blobs: Vec<Vec<u8>>,
}

impl Message {
    /// Adds bytes. Returns their index.
    pub(crate) fn bytes(&mut self, bytes: Vec<u8>) -> usize {
        self.blobs.push(bytes);
        self.blobs.len() - 1
    }

    /// Adds numbers in single precision. Returns their index.
    pub(crate) fn floats(&mut self, numbers: impl IntoIterator<Item = f32>) -> usize {
        self.bytes(numbers.into_iter().flat_map(f32::to_le_bytes).collect())
    }

    /// Adds indices. Returns their index.
    pub(crate) fn indices(&mut self, numbers: impl IntoIterator<Item = u32>) -> usize {
        self.bytes(numbers.into_iter().flat_map(u32::to_le_bytes).collect())
    }

    pub(crate) fn finish(self, mut content: Value) -> Vec<u8> {
        content["blobs"] = json!(self.blobs.iter().map(Vec::len).collect::<Vec<_>>());
        let mut text = content.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let mut bytes = (text.len() as u32).to_le_bytes().to_vec();
        bytes.append(&mut text);
        for mut blob in self.blobs {
            blob.resize(blob.len().next_multiple_of(4), 0);
            bytes.append(&mut blob);
        }
        bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_follow_the_text_at_multiples_of_four_bytes() {
        let mut message = Message::default();
        assert_eq!((message.bytes(vec![7; 5]), message.floats([1.0, -2.0])), (0, 1));
        let bytes = message.finish(json!({ "type": "state" }));
        let length = u32::from_le_bytes(*bytes.first_chunk().unwrap()) as usize;
        let content: Value = serde_json::from_slice(&bytes[4..4 + length]).unwrap();
        assert_eq!(content, json!({ "type": "state", "blobs": [5, 8] }));
        let rest = &bytes[4 + length..];
        assert_eq!((length % 4, &rest[..8]), (0, [7, 7, 7, 7, 7, 0, 0, 0].as_slice()));
        assert_eq!(rest[8..12], 1.0_f32.to_le_bytes());
    }
}
