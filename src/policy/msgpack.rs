//! Msgpack messages and the numpy arrays in them, in the conventions of openpi and vla-eval.
//!
//! openpi writes an array as `{b"__ndarray__": true, b"data": bytes, b"dtype": "<f4", b"shape": [H, A]}` with
//! keys of type bin; vla-eval's keys are of type str. The reader accepts both, numpy scalars
//! (`__npgeneric__`) and nested lists.

use std::collections::HashSet;

use rmpv::Value;

use softvt_common::npy::{NpyArray, element_size};

/// Encodes an array. Keys are of type bin (openpi) or str (vla-eval).
pub fn pack_array(array: NpyArray, bin_keys: bool) -> Value {
    let key = |name: &str| if bin_keys { Value::Binary(name.into()) } else { Value::from(name) };
    let shape = array.shape.into_iter().map(Value::from).collect();
    Value::Map(vec![
        (key("__ndarray__"), Value::Boolean(true)),
        (key("data"), Value::Binary(array.data)),
        (key("dtype"), Value::from(array.dtype)),
        (key("shape"), Value::Array(shape)),
    ])
}

/// Entry of a map by name; its key may be of type str or bin.
pub fn entry<'a>(map: &'a Value, name: &str) -> Option<&'a Value> {
    let is = |key: &Value| match key {
        Value::String(text) => text.as_str() == Some(name),
        Value::Binary(bytes) => bytes == name.as_bytes(),
        _ => false,
    };
    map.as_map()?.iter().find(|(key, _)| is(key)).map(|(_, value)| value)
}

pub fn names(map: &Value) -> String {
    let name = |key: &Value| match key {
        Value::String(text) => text.as_str().map(str::to_owned),
        Value::Binary(bytes) => Some(String::from_utf8_lossy(bytes).into_owned()),
        other => Some(other.to_string()),
    };
    let all: Vec<String> = map.as_map().into_iter().flatten().filter_map(|(key, _)| name(key)).collect();
    if all.is_empty() { "nothing".to_owned() } else { all.join(", ") }
}

/// Description of the type of a value, for error messages.
pub fn kind(value: &Value) -> &'static str {
    match value {
        Value::Nil => "nil",
        Value::Boolean(_) => "a boolean",
        Value::Integer(_) | Value::F32(_) | Value::F64(_) => "a number",
        Value::String(_) => "text",
        Value::Binary(_) => "bytes",
        Value::Array(_) => "a list",
        Value::Map(_) => "a map",
        Value::Ext(..) => "an extension",
    }
}

/// Deepest nesting that is read.
const MAX_DEPTH: usize = 64;
/// Largest number of values of a message, and of elements of an array. A value takes one byte in a message, and 40 in
/// memory.
const MAX_VALUES: usize = 1 << 20;
const TRUNCATED: &str = "not msgpack: the end is missing";

#[derive(Clone, Debug, PartialEq)]
pub struct NumberArray {
    /// Lengths of the axes; empty for a scalar.
    pub shape: Vec<usize>,
    /// The elements in C order.
    pub values: Vec<f64>,
}

pub fn map<K: Into<Value>>(entries: impl IntoIterator<Item = (K, Value)>) -> Value {
    Value::Map(entries.into_iter().map(|(key, value)| (key.into(), value)).collect())
}

pub fn pack(value: &Value) -> Vec<u8> {
    let mut bytes = Vec::new();
    // Writing to a vector does not fail.
    let _ = rmpv::encode::write_value(&mut bytes, value);
    bytes
}

/// Decodes a message, which must be exactly one value, in whose maps no key is given twice. The values are counted
/// before memory is allocated for them. The text of an error completes "the message is …".
///
/// # Errors
/// The bytes are not one valid value, hold too many values, or a map in them has a key twice.
pub fn unpack(mut bytes: &[u8]) -> Result<Value, String> {
    use rmpv::decode::{Error, read_value_with_max_depth};
    count_values(bytes)?;
    match read_value_with_max_depth(&mut bytes, MAX_DEPTH) {
        Ok(value) if bytes.is_empty() => match duplicate_key(&value) {
            Some(key) => Err(format!("ambiguous: a map has the key {key:?} twice")),
            None => Ok(value),
        },
        Ok(_) => Err(format!("more than one msgpack value: {} bytes follow the first", bytes.len())),
        Err(Error::DepthLimitExceeded) => Err(format!("not msgpack: nested more than {MAX_DEPTH} times")),
        Err(Error::InvalidMarkerRead(_) | Error::InvalidDataRead(_)) => Err(TRUNCATED.to_owned()),
    }
}

/// A key that a map in `value` has twice. Keys of type str and bin with the same bytes are the same, as in [`entry`].
fn duplicate_key(value: &Value) -> Option<String> {
    match value {
        Value::Array(items) => items.iter().find_map(duplicate_key),
        Value::Map(entries) => {
            let mut seen = HashSet::new();
            entries.iter().find_map(|(key, value)| {
                let bytes = match key {
                    Value::String(text) => text.as_bytes(),
                    Value::Binary(bytes) => bytes,
                    _ => return duplicate_key(value),
                };
                match seen.insert(bytes) {
                    true => duplicate_key(value),
                    false => Some(String::from_utf8_lossy(bytes).into_owned()),
                }
            })
        }
        _ => None,
    }
}

/// Counts the values of the first value in `bytes`, its own and those that it contains.
/// Refuses a value that is cut off, or has more than [`MAX_VALUES`].
fn count_values(mut bytes: &[u8]) -> Result<usize, String> {
    let (mut counted, mut pending) = (0, 1);
    while pending > 0 {
        let header = ValueHeader::read(&mut bytes).ok_or(TRUNCATED)?;
        bytes = bytes.get(header.data_bytes..).ok_or(TRUNCATED)?;
        (counted, pending) = (counted + 1, pending - 1 + header.children);
        // Every value takes at least one byte, so that a false length is found before its values are counted.
        if pending > bytes.len() {
            return Err(TRUNCATED.to_owned());
        }
        if counted + pending > MAX_VALUES {
            return Err(format!("too long: more than {MAX_VALUES} values"));
        }
    }
    Ok(counted)
}

/// Counts of the bytes and of the values that follow the first bytes of an encoded value.
struct ValueHeader {
    data_bytes: usize,
    children: usize,
}

impl ValueHeader {
    /// Reads the marker and the length of a value. `None` at the end of the bytes.
    fn read(bytes: &mut &[u8]) -> Option<Self> {
        let (&marker, rest) = bytes.split_first()?;
        *bytes = rest;
        let mut length = |size: usize| {
            let (number, rest) = bytes.split_at_checked(size)?;
            *bytes = rest;
            Some(number.iter().fold(0_usize, |all, byte| all << 8 | usize::from(*byte)))
        };
        let data = |data_bytes| Some(Self { data_bytes, children: 0 });
        let children = |children| Some(Self { data_bytes: 0, children });
        let low = |mask: u8| usize::from(marker & mask);
        match marker {
            // Integers below 128 and from −32, nil, booleans, and the marker that msgpack leaves unused.
            0x00..=0x7F | 0xE0..=0xFF | 0xC0..=0xC3 => data(0),
            0x80..=0x8F => children(2 * low(0x0F)),
            0x90..=0x9F => children(low(0x0F)),
            0xA0..=0xBF => data(low(0x1F)),
            0xC4 | 0xD9 => data(length(1)?),
            0xC5 | 0xDA => data(length(2)?),
            0xC6 | 0xDB => data(length(4)?),
            // Extensions have a byte with their type.
            0xC7 => data(length(1)? + 1),
            0xC8 => data(length(2)? + 1),
            0xC9 => data(length(4)? + 1),
            // Floats and integers of 4, 8 or 1, 2, 4, 8 bytes; extensions of 1 to 16.
            0xCA => data(4),
            0xCB => data(8),
            0xCC..=0xCF => data(1 << (marker - 0xCC)),
            0xD0..=0xD3 => data(1 << (marker - 0xD0)),
            0xD4..=0xD8 => data((1 << (marker - 0xD4)) + 1),
            0xDC => children(length(2)?),
            0xDD => children(length(4)?),
            0xDE => children(2 * length(2)?),
            0xDF => children(2 * length(4)?),
        }
    }
}

/// Reads a numpy array, a numpy scalar, a number or nested lists of numbers. The text of an error describes another
/// value that was found in its place.
///
/// # Errors
/// The value is something else, or its shape and data disagree.
pub fn numbers(value: &Value) -> Result<NumberArray, String> {
    if entry(value, "__ndarray__").is_some() {
        return ndarray(value);
    }
    if entry(value, "__npgeneric__").is_some() {
        let number = entry(value, "data").and_then(Value::as_f64);
        let number = number.ok_or("a numpy scalar that is not a number")?;
        return Ok(NumberArray { shape: Vec::new(), values: vec![number] });
    }
    let mut values = Vec::new();
    let shape = nested(value, &mut values, 0)?;
    Ok(NumberArray { shape, values })
}

/// Largest number of axes of nested lists.
const MAX_AXES: usize = 4;

fn nested(value: &Value, values: &mut Vec<f64>, depth: usize) -> Result<Vec<usize>, String> {
    if let Some(number) = value.as_f64() {
        values.push(number);
        return Ok(Vec::new());
    }
    let items = value.as_array().ok_or(kind(value))?;
    if depth == MAX_AXES {
        return Err(format!("a list with more than {MAX_AXES} axes"));
    }
    let mut inner: Option<Vec<usize>> = None;
    for item in items {
        let shape = nested(item, values, depth + 1)?;
        if inner.as_ref().is_some_and(|known| *known != shape) {
            return Err("a list whose rows differ in length".to_owned());
        }
        inner = Some(shape);
    }
    Ok(std::iter::once(items.len()).chain(inner.unwrap_or_default()).collect())
}

fn ndarray(value: &Value) -> Result<NumberArray, String> {
    let field = |name| entry(value, name).ok_or_else(|| format!("an array without {name}"));
    let (dtype, data, shape) =
        (field("dtype")?.as_str(), field("data")?.as_slice(), field("shape")?.as_array());
    let shape: Option<Vec<usize>> =
        shape.and_then(|shape| shape.iter().map(|n| n.as_u64()?.try_into().ok()).collect());
    let (Some(dtype), Some(data), Some(shape)) = (dtype, data, shape) else {
        return Err("an array whose dtype is not text, data not bytes, or shape not whole numbers".to_owned());
    };
    let size = element_size(dtype).ok_or_else(|| format!("an array of dtype {dtype:?}"))?;
    if shape.iter().try_fold(size, |all, n| all.checked_mul(*n)) != Some(data.len()) {
        let bytes = data.len();
        return Err(format!("an array of shape {shape:?} and dtype {dtype:?} with {bytes} bytes"));
    }
    if data.len() / size > MAX_VALUES {
        return Err(format!("an array with more than {MAX_VALUES} elements"));
    }
    let array = NpyArray { dtype: dtype.to_owned(), shape, data: data.to_vec() };
    let values = array.values();
    Ok(NumberArray { shape: array.shape, values })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_are_packed_as_by_openpis_client() {
        let zeros = pack_array(NpyArray::from_f32(vec![2, 3], [0.0; 6]), true);
        let mut packed = Vec::new();
        rmpv::encode::write_value(&mut packed, &Value::Map(vec![("a".into(), zeros)])).unwrap();
        let mut expected = b"\x81\xa1a\x84\xc4\x0b__ndarray__\xc3\xc4\x04data\xc4\x18".to_vec();
        expected.extend([0; 24]);
        expected.extend(b"\xc4\x05dtype\xa3<f4\xc4\x05shape\x92\x02\x03");
        assert_eq!(packed, expected);
    }

    #[test]
    fn arrays_are_read_with_both_types_of_keys() {
        for bin in [true, false] {
            let value = pack_array(NpyArray::from_f32(vec![2, 2], [1.0, -2.5, 3.0, 1e-3]), bin);
            let found = numbers(&value).unwrap();
            assert_eq!((found.shape, found.values[1]), (vec![2, 2], -2.5));
        }
        let list = Value::Array(vec![Value::Array(vec![1.into(), Value::F64(0.5)])]);
        assert_eq!(numbers(&list).unwrap(), NumberArray { shape: vec![1, 2], values: vec![1.0, 0.5] });
    }

    #[test]
    fn every_dtype_is_read_with_its_width_sign_and_byte_order() {
        let of = |dtype: &'static str, data: &[u8]| {
            let array = NpyArray { dtype: dtype.to_owned(), shape: vec![1], data: data.to_vec() };
            numbers(&pack_array(array, true)).map(|found| found.values[0])
        };
        assert_eq!(of("<f2", &[0x00, 0xC1]), Ok(-2.5));
        assert_eq!(of("<f8", &2.25_f64.to_le_bytes()), Ok(2.25));
        assert_eq!(of(">f4", &(-7.5_f32).to_be_bytes()), Ok(-7.5));
        assert_eq!(of("|i1", &[0xFF]), Ok(-1.0));
        assert_eq!(of("|u1", &[0xFF]), Ok(255.0));
        assert_eq!(of("<i8", &(-9_i64).to_le_bytes()), Ok(-9.0));
        assert!(of("<c8", &[0; 8]).is_err_and(|error| error.contains("dtype \"<c8\"")));
        assert!(of("<f4", &[0; 5]).is_err_and(|error| error.contains("5 bytes")));
        assert!(of("é", &[0; 5]).is_err());
    }

    #[test]
    fn a_message_is_one_whole_value() {
        let value =
            Value::Array(vec![map([("a", Value::from(-3))]), Value::Binary(vec![0xDD; 300]), Value::Nil]);
        let bytes = pack(&value);
        assert_eq!(unpack(&bytes), Ok(value));
        for cut in [1, 7, bytes.len() - 1] {
            assert!(unpack(&bytes[..cut]).is_err_and(|error| error.ends_with("the end is missing")));
        }
        assert!(unpack(&[&bytes[..], &[0]].concat()).is_err_and(|error| error.contains("1 bytes follow")));
        let deep = [&[0x91; 5000][..], &[0xC0]].concat();
        assert!(unpack(&deep).is_err_and(|error| error.contains("nested more than 64 times")));
    }

    #[test]
    fn values_are_counted_in_every_encoding() {
        let nested = Value::Array(vec![
            map([("a", Value::from(-3)), ("b", Value::from(300)), ("c", Value::F64(0.5))]),
            Value::Array(vec![Value::F32(1.0); 20]),
            Value::Binary(vec![0xDD; 300]),
            Value::from("é".repeat(70_000)),
            Value::Ext(7, vec![0xFF; 16]),
            Value::Ext(7, vec![0xFF; 1000]),
            Value::from(u64::MAX),
            Value::from(i64::MIN),
            Value::Nil,
            Value::Array(vec![Value::from(1_u16 << 12); 70_000]),
        ]);
        let bytes = pack(&nested);
        assert_eq!(count_values(&bytes), Ok(1 + 7 + 21 + 7 + 70_001));
        assert_eq!(unpack(&bytes), Ok(nested));
    }

    #[test]
    fn a_message_of_many_small_values_is_refused_before_it_is_decoded() {
        let count: u32 = 4 << 20;
        let mut bytes = vec![0xDD];
        bytes.extend(count.to_be_bytes());
        bytes.resize(bytes.len() + count as usize, 0xC0);
        assert!(unpack(&bytes).is_err_and(|error| error.contains("more than 1048576 values")));
        let array = NpyArray { dtype: "|u1".to_owned(), shape: vec![2 << 20], data: vec![0; 2 << 20] };
        let refused = numbers(&pack_array(array, true));
        assert!(refused.is_err_and(|error| error.contains("more than 1048576 elements")));
    }

    #[test]
    fn a_map_with_a_key_twice_is_refused() {
        let message = |keys: [Value; 2]| {
            let inner = Value::Map(keys.map(|key| (key, Value::from(1))).to_vec());
            unpack(&pack(&map([("request", Value::Array(vec![inner]))])))
        };
        assert!(message(["type".into(), "task".into()]).is_ok());
        for twice in ["type".into(), Value::Binary(b"type".to_vec())] {
            assert!(message(["type".into(), twice]).is_err_and(|error| error.contains("\"type\" twice")));
        }
    }

    #[test]
    fn values_that_are_not_arrays_are_described() {
        let ragged = Value::Array(vec![Value::Array(vec![1.into()]), Value::Array(vec![])]);
        assert!(numbers(&ragged).is_err_and(|error| error.contains("differ in length")));
        assert_eq!(numbers(&"hello".into()), Err("text".to_owned()));
        let huge = Value::Map(vec![
            ("__ndarray__".into(), true.into()),
            ("data".into(), Value::Binary(vec![0; 8])),
            ("dtype".into(), "<f4".into()),
            ("shape".into(), Value::Array(vec![u64::MAX.into(), 2.into()])),
        ]);
        assert!(numbers(&huge).is_err());
    }
}
