//! Images of Taxim's tables, and tables with the layout of the package, whole and broken.

use std::{fs, io::Write, path::Path};

use super::*;
use crate::tactile::{
    PadWrench,
    elastic::tests::{graph, pressed},
};
use softvt_common::npy::NpyArray;
use softvt_robot::PadSurface;
use softvt_robot::tactile::TactileSpec;

const BINS: usize = 125;

/// An array as NumPy saves it.
fn npy(dtype: &str, shape: &[usize], data: &[u8]) -> Vec<u8> {
    NpyArray { dtype: dtype.to_owned(), shape: shape.to_vec(), data: data.to_vec() }.to_npy()
}

/// Arrays of an archive: names and contents of their files.
type Entries = Vec<(&'static str, Vec<u8>)>;

fn write(path: &Path, entries: &[(&'static str, Vec<u8>)]) {
    let mut zip = zip::ZipWriter::new(fs::File::create(path).expect("a file"));
    let stored = zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
    for (name, bytes) in entries {
        zip.start_file(format!("{name}.npy"), stored).expect("an entry");
        zip.write_all(bytes).expect("written");
    }
    zip.finish().expect("finished");
}

/// A table whose entries are all the quadratic [0, 0, 0, 0, 0, `constant`].
fn grad(constant: f64) -> Vec<u8> {
    let entry: Vec<u8> =
        [0.0, 0.0, 0.0, 0.0, 0.0, constant].iter().flat_map(|v: &f64| v.to_le_bytes()).collect();
    npy("<f8", &[125, 125, 6], &entry.repeat(BINS * BINS))
}

/// `polycalib.npz` as in the package: changes of 1, 2 and 3 grey levels.
fn polycalib() -> Entries {
    let bins = npy("<i4", &[], &(BINS as i32).to_le_bytes());
    vec![("bins", bins), ("grad_r", grad(1.0)), ("grad_g", grad(2.0)), ("grad_b", grad(3.0))]
}

/// `dataPack.npz` as in the package, with one press: blue 10, green 20, red 30.
fn data_pack() -> Entries {
    let pixels = [10, 20, 30].repeat(480 * 640);
    vec![
        ("f0", npy("|u1", &[480, 640, 3], &pixels)),
        ("imgs", npy("|u1", &[1, 480, 640, 3], &pixels)),
        ("touch_center", npy("<u2", &[1, 2], &[64, 1, 240, 0])),
        ("touch_radius", npy("<u2", &[1], &[45, 0])),
        ("names", npy("<U2", &[1], &[0; 8])),
        ("img_size", npy("<i4", &[3], &[224, 1, 0, 0, 128, 2, 0, 0, 3, 0, 0, 0])),
    ]
}

/// Result of loading a folder with the file `name` replaced.
fn loaded(name: &str, entries: &[(&'static str, Vec<u8>)]) -> Result<TaximOptics, String> {
    let folder = tempfile::tempdir().expect("a folder");
    write(&folder.path().join("polycalib.npz"), &polycalib());
    write(&folder.path().join("dataPack.npz"), &data_pack());
    write(&folder.path().join(name), entries);
    TaximOptics::load(folder.path()).map_err(|error| error.to_string())
}

/// Error message with one array replaced, or left out.
fn refused(name: &str, key: &str, by: Option<Vec<u8>>) -> String {
    let mut entries = if name == "polycalib.npz" { polycalib() } else { data_pack() };
    entries.retain(|(known, _)| *known != key);
    entries.extend(by.map(|bytes| (known_key(key), bytes)));
    loaded(name, &entries).expect_err("a broken file")
}

fn known_key(key: &str) -> &'static str {
    ["bins", "grad_r", "grad_g", "grad_b", "f0"].into_iter().find(|known| *known == key).expect("a known key")
}

#[test]
fn tables_of_the_package_are_read_with_its_order_of_red_and_blue() {
    let taxim = loaded("dataPack.npz", &data_pack()).expect("whole files");
    let gel = Gel::new(&TactileSpec::default(), PadSurface::default()).expect("default numbers");
    let rgb = taxim.render(&gel, None).into_raw();
    // The image is stored blue first; its tables are named the other way round.
    assert!(rgb.chunks_exact(3).all(|pixel| pixel == [30 + 3, 20 + 2, 10 + 1]), "{:?}", &rgb[..3]);
}

#[test]
fn every_broken_array_is_named_with_its_file() {
    let number = |value: f64| {
        let mut bytes = grad(1.0);
        let at = bytes.len() - 8;
        bytes[at..].copy_from_slice(&value.to_le_bytes());
        bytes
    };
    let (poly, pack) = ("polycalib.npz", "dataPack.npz");
    let mut short = grad(1.0);
    short.truncate(2000);
    let bins = |dtype: &str, bytes: &[u8]| Some(npy(dtype, &[], bytes));
    for (file, key, by, what) in [
        (poly, "bins", None, "no array \"bins\"; the file has: grad_r, grad_g, grad_b"),
        (pack, "f0", None, "no array \"f0\"; the file has: imgs, touch_center"),
        (poly, "bins", Some(npy("<i4", &[2], &[0; 8])), "array \"bins\": expected the shape []"),
        (poly, "bins", bins("<i4", &[255; 4]), "array \"bins\": expected 2..4096, got -1"),
        (poly, "bins", bins("<i4", &[9, 0, 0, 0]), "array \"grad_b\": expected the shape [9, 9, 6]"),
        (poly, "bins", bins("<f8", &[0; 8]), "array \"bins\": expected type i4 or i8, got f8"),
        (poly, "grad_r", Some(npy("|O", &[1], &[0])), "array \"grad_r\": of type 'O'"),
        (poly, "grad_r", Some(npy(">f8", &[1], &[0; 8])), "array \"grad_r\": of type '>f8'"),
        (poly, "grad_b", Some(number(f64::NAN)), "array \"grad_b\": entry 93749 is NaN"),
        (poly, "grad_r", Some(short), "array \"grad_r\": 1872 bytes do not fill the shape [125, 125, 6]"),
        (poly, "grad_r", Some(b"not an array".to_vec()), "array \"grad_r\": not an .npy array"),
        (
            pack,
            "f0",
            Some(npy("|u1", &[2, 2, 3], &[0; 12])),
            "array \"f0\": expected the shape [480, 640, 3]",
        ),
    ] {
        let message = refused(file, key, by);
        assert!(
            message.contains(file) && message.contains(what),
            "{file}, {key}: expected \"{what}\", got \"{message}\""
        );
    }
}

#[test]
fn a_truncated_or_damaged_file_is_named_with_the_requested_array() {
    let folder = tempfile::tempdir().expect("a folder");
    let (poly, pack) = (folder.path().join("polycalib.npz"), folder.path().join("dataPack.npz"));
    write(&poly, &polycalib());
    write(&pack, &data_pack());
    let error = || TaximOptics::load(folder.path()).expect_err("a broken file").to_string();
    let whole = fs::read(&poly).expect("written");
    for length in [0, 1, 1000, whole.len() / 2, whole.len() - 1] {
        fs::write(&poly, &whole[..length]).expect("written");
        let message = error();
        assert!(
            message.contains("polycalib.npz") && message.contains("\"bins\""),
            "{length} bytes: {message}"
        );
    }
    // One flipped bit in grad_g, so that its checksum is wrong.
    let mut damaged = whole.clone();
    let at = whole.windows(6).position(|w| w == b"grad_g").expect("an entry") + 10_000;
    damaged[at] ^= 1;
    fs::write(&poly, &damaged).expect("written");
    let message = error();
    assert!(message.contains("polycalib.npz: array \"grad_g\": cannot be read to its end"), "{message}");
    fs::write(&poly, &whole).expect("written");
    fs::write(&pack, b"PK").expect("written");
    let message = error();
    assert!(message.contains("dataPack.npz") && message.contains("\"f0\""), "{message}");
}

/// Tables that add red where the surface falls to the right, on an image of grey level 10.
fn painted() -> TaximOptics {
    let bins = 125;
    let mut red = vec![0.0; bins * bins * 6];
    for size in 5..bins {
        // A direction of 0: the middle bin.
        for direction in 57..67 {
            red[6 * (size * bins + direction) + 5] = 100.0;
        }
    }
    let zeros = vec![0.0; bins * bins * 6];
    TaximOptics {
        bins,
        table: [red, zeros.clone(), zeros],
        background: vec![10.0; 3 * IMAGE_SIZE[0] * IMAGE_SIZE[1]],
    }
}

#[test]
fn the_table_is_read_at_size_and_direction_of_the_rise() {
    let gel = Gel::new(&TactileSpec::default(), PadSurface::default()).expect("default numbers");
    let ball = graph(8e-3, 2e-4, |x, y| (x * x + y * y) / 8e-3);
    let field = pressed(&gel, &ball, PadWrench::new(1.5, [0.0; 2], 0.0, [0.0; 2]));
    let rgb = painted().render(&gel, Some(&field)).into_raw();
    let red = |x: usize, y: usize| rgb[3 * (y * IMAGE_SIZE[0] + x)];
    // The dent rises towards its middle: to the right on its left side.
    assert_eq!((red(140, 120), red(180, 120), red(160, 100), red(10, 10)), (110, 10, 10, 10));
    assert!(painted().render(&gel, None).iter().all(|&value| value == 10));
}

#[test]
fn a_blur_keeps_a_constant_and_spreads_a_point() {
    let mut image = vec![3.0; 40 * 30];
    blur(&mut image, 40, 1, 2.0);
    assert!(image.iter().all(|v| (v - 3.0).abs() < 1e-5));
    let mut point = vec![0.0; 41 * 41];
    point[20 * 41 + 20] = 1.0;
    blur(&mut point, 41, 1, 2.0);
    let expected = 1.0 / (2.0 * std::f32::consts::PI * 4.0);
    assert!((point[20 * 41 + 20] / expected - 1.0).abs() < 0.02);
}
