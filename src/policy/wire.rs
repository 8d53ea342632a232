//! Arrays on the wire: msgpack maps as openpi and vla-eval write them.
//!
//! openpi writes `{b"__ndarray__": true, b"data": bytes, b"dtype": "<f4", b"shape": [H, A]}` with keys of type bin, vla-eval
//! the same with keys of type str, without the b. Readers take both, scalars (`__npgeneric__`) and plain nested lists.

use rmpv::Value;

use crate::npy::{NpyArray, element_size};

/// An array as msgpack; keys are bin for openpi and str for vla-eval.
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

/// The entry of a map, whatever type its key has.
pub fn entry<'a>(map: &'a Value, name: &str) -> Option<&'a Value> {
    let is = |key: &Value| match key {
        Value::String(text) => text.as_str() == Some(name),
        Value::Binary(bytes) => bytes == name.as_bytes(),
        _ => false,
    };
    map.as_map()?.iter().find(|(key, _)| is(key)).map(|(_, value)| value)
}

/// Names of a map's entries, for messages.
pub fn names(map: &Value) -> String {
    let name = |key: &Value| match key {
        Value::String(text) => text.as_str().map(str::to_owned),
        Value::Binary(bytes) => Some(String::from_utf8_lossy(bytes).into_owned()),
        other => Some(other.to_string()),
    };
    let all: Vec<String> = map.as_map().into_iter().flatten().filter_map(|(key, _)| name(key)).collect();
    if all.is_empty() { "nothing".to_owned() } else { all.join(", ") }
}

/// What kind of value this is, for messages.
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

/// Values inside of values that are read.
const NESTED: usize = 64;

/// The one msgpack value that a message is.
///
/// # Errors
/// A fragment for people: what the bytes are instead.
pub fn unpack(mut bytes: &[u8]) -> Result<Value, String> {
    use rmpv::decode::{Error, read_value_with_max_depth};
    match read_value_with_max_depth(&mut bytes, NESTED) {
        Ok(value) if bytes.is_empty() => Ok(value),
        Ok(_) => Err(format!("more than one msgpack value: {} bytes stand behind it", bytes.len())),
        Err(Error::DepthLimitExceeded) => Err(format!("no msgpack: nested more than {NESTED} times")),
        Err(Error::InvalidMarkerRead(_) | Error::InvalidDataRead(_)) => {
            Err("no msgpack: the end is missing".to_owned())
        }
    }
}

/// Numbers and the lengths of their axes.
///
/// # Errors
/// A fragment for people: what it is instead.
pub fn numbers(value: &Value) -> Result<(Vec<usize>, Vec<f64>), String> {
    if entry(value, "__ndarray__").is_some() {
        return array(value);
    }
    if entry(value, "__npgeneric__").is_some() {
        let number =
            entry(value, "data").and_then(Value::as_f64).ok_or("a numpy scalar that is no number")?;
        return Ok((Vec::new(), vec![number]));
    }
    let mut found = Vec::new();
    let shape = nested(value, &mut found, 0)?;
    Ok((shape, found))
}

/// More axes than any reply has.
const DEEPEST: usize = 4;

fn nested(value: &Value, found: &mut Vec<f64>, depth: usize) -> Result<Vec<usize>, String> {
    if let Some(number) = value.as_f64() {
        found.push(number);
        return Ok(Vec::new());
    }
    let Some(items) = value.as_array() else { return Err(kind(value).to_owned()) };
    if depth == DEEPEST {
        return Err(format!("a list with more than {DEEPEST} axes"));
    }
    let mut inner: Option<Vec<usize>> = None;
    for item in items {
        let shape = nested(item, found, depth + 1)?;
        if inner.as_ref().is_some_and(|known| *known != shape) {
            return Err("a list whose rows differ in length".to_owned());
        }
        inner = Some(shape);
    }
    Ok(std::iter::once(items.len()).chain(inner.unwrap_or_default()).collect())
}

fn array(value: &Value) -> Result<(Vec<usize>, Vec<f64>), String> {
    let dtype = entry(value, "dtype").and_then(Value::as_str).ok_or("an array without dtype")?;
    let data = entry(value, "data").and_then(Value::as_slice).ok_or("an array without data")?;
    let shape = entry(value, "shape").and_then(Value::as_array).ok_or("an array without shape")?;
    let shape: Option<Vec<usize>> = shape.iter().map(|n| n.as_u64()?.try_into().ok()).collect();
    let shape = shape.ok_or("an array whose shape is not made of whole numbers")?;
    let size = element_size(dtype).ok_or_else(|| format!("an array of dtype {dtype:?}"))?;
    let count = shape.iter().try_fold(1_usize, |all, n| all.checked_mul(*n));
    if count.and_then(|count| count.checked_mul(size)) != Some(data.len()) {
        return Err(format!("an array of shape {shape:?} and dtype {dtype:?} with {} bytes", data.len()));
    }
    let array = NpyArray { dtype: dtype.to_owned(), shape, data: data.to_vec() };
    let values = array.values();
    Ok((array.shape, values))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_array_packs_as_openpis_client_packs_it() {
        let zeros = pack_array(NpyArray::from_f32(vec![2, 3], [0.0; 6]), true);
        let mut packed = Vec::new();
        rmpv::encode::write_value(&mut packed, &Value::Map(vec![("a".into(), zeros)])).unwrap();
        let mut expected = b"\x81\xa1a\x84\xc4\x0b__ndarray__\xc3\xc4\x04data\xc4\x18".to_vec();
        expected.extend([0; 24]);
        expected.extend(b"\xc4\x05dtype\xa3<f4\xc4\x05shape\x92\x02\x03");
        assert_eq!(packed, expected);
    }

    #[test]
    fn arrays_come_back_with_both_kinds_of_keys() {
        for bin in [true, false] {
            let value = pack_array(NpyArray::from_f32(vec![2, 2], [1.0, -2.5, 3.0, 1e-3]), bin);
            let (shape, found) = numbers(&value).unwrap();
            assert_eq!((shape, found[1]), (vec![2, 2], -2.5));
        }
        let list = Value::Array(vec![Value::Array(vec![1.into(), Value::F64(0.5)])]);
        assert_eq!(numbers(&list).unwrap(), (vec![1, 2], vec![1.0, 0.5]));
    }

    #[test]
    fn every_type_of_number_is_read_at_its_width_sign_and_order() {
        let of = |dtype: &'static str, data: &[u8]| {
            let array = NpyArray { dtype: dtype.to_owned(), shape: vec![1], data: data.to_vec() };
            numbers(&pack_array(array, true)).map(|(_, found)| found[0])
        };
        assert_eq!(of("<f2", &[0x00, 0xC1]), Ok(-2.5));
        assert_eq!(of("<f8", &2.25_f64.to_le_bytes()), Ok(2.25));
        assert_eq!(of(">f4", &(-7.5_f32).to_be_bytes()), Ok(-7.5));
        assert_eq!(of("|i1", &[0xFF]), Ok(-1.0));
        assert_eq!(of("|u1", &[0xFF]), Ok(255.0));
        assert_eq!(of("<i8", &(-9_i64).to_le_bytes()), Ok(-9.0));
        assert!(of("<c8", &[0; 8]).is_err_and(|e| e.contains("dtype \"<c8\"")));
        assert!(of("<f4", &[0; 5]).is_err_and(|e| e.contains("5 bytes")));
        assert!(of("é", &[0; 5]).is_err());
    }

    #[test]
    fn what_is_no_array_is_named() {
        let ragged = Value::Array(vec![Value::Array(vec![1.into()]), Value::Array(vec![])]);
        assert!(numbers(&ragged).is_err_and(|e| e.contains("differ in length")));
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
