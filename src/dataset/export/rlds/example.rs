//! Messages `tf.train.Example` of TensorFlow (`example.proto`, `feature.proto`), without its `.proto` files.

use std::collections::BTreeMap;

use prost::{Message, Oneof};

/// A record: lists of values by their keys.
#[derive(Clone, PartialEq, Message)]
pub(super) struct Example {
    #[prost(message, optional, tag = "1")]
    features: Option<Features>,
}

#[derive(Clone, PartialEq, Message)]
struct Features {
    // Sorted, so that the bytes depend on the values only.
    #[prost(btree_map = "string, message", tag = "1")]
    feature: BTreeMap<String, Feature>,
}

#[derive(Clone, PartialEq, Message)]
pub(super) struct Feature {
    #[prost(oneof = "FeatureList", tags = "1, 2, 3")]
    list: Option<FeatureList>,
}

#[derive(Clone, PartialEq, Oneof)]
enum FeatureList {
    #[prost(message, tag = "1")]
    Bytes(BytesList),
    #[prost(message, tag = "2")]
    Floats(FloatList),
    #[prost(message, tag = "3")]
    Integers(Int64List),
}

#[derive(Clone, PartialEq, Message)]
struct BytesList {
    #[prost(bytes = "vec", repeated, tag = "1")]
    value: Vec<Vec<u8>>,
}

#[derive(Clone, PartialEq, Message)]
struct FloatList {
    #[prost(float, repeated, tag = "1")]
    value: Vec<f32>,
}

#[derive(Clone, PartialEq, Message)]
struct Int64List {
    #[prost(int64, repeated, tag = "1")]
    value: Vec<i64>,
}

impl Example {
    pub(super) fn new(features: impl IntoIterator<Item = (String, Feature)>) -> Self {
        Self { features: Some(Features { feature: features.into_iter().collect() }) }
    }
}

impl Feature {
    pub(super) fn bytes(value: Vec<Vec<u8>>) -> Self {
        Self { list: Some(FeatureList::Bytes(BytesList { value })) }
    }

    /// The same text `count` times.
    pub(super) fn text(text: &str, count: usize) -> Self {
        Self::bytes(vec![text.as_bytes().to_vec(); count])
    }

    pub(super) fn floats(value: Vec<f32>) -> Self {
        Self { list: Some(FeatureList::Floats(FloatList { value })) }
    }

    pub(super) fn integers(value: Vec<i64>) -> Self {
        Self { list: Some(FeatureList::Integers(Int64List { value })) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_example_has_the_bytes_that_tensorflow_writes() {
        // tf.train.Example(features=tf.train.Features(feature={key: tf.train.Feature(…)})).SerializeToString()
        let one = |key: &str, feature| Example::new([(key.to_owned(), feature)]).encode_to_vec();
        let floats = one("a", Feature::floats(vec![0.5, -2.0]));
        assert_eq!(floats, b"\x0a\x13\x0a\x11\x0a\x01a\x12\x0c\x12\x0a\x0a\x08\0\0\0\x3f\0\0\0\xc0");
        let integers = one("b", Feature::integers(vec![1, 300]));
        assert_eq!(integers, b"\x0a\x0e\x0a\x0c\x0a\x01b\x12\x07\x1a\x05\x0a\x03\x01\xac\x02");
        let texts = one("c", Feature::text("xy", 2));
        assert_eq!(texts, b"\x0a\x11\x0a\x0f\x0a\x01c\x12\x0a\x0a\x08\x0a\x02xy\x0a\x02xy");
    }
}
