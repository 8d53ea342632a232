//! Mesh files as other programs write them.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{
    import::{CUBE, Glb, METRES, read_obj, stl},
    rng,
};
use crate::{
    Aabb, Quat, Vec3,
    import::{MeshFormat, MeshImportError, MeshImportOptions, import, import_colours},
    mesh::{Mesh, MeshError},
    shape::Shape,
};

/// An OBJ file of a prism of height 1 over an outline in the x-y plane, whose caps are one polygon each. `turn` rotates
/// it, and `first` is the first corner of the caps.
fn prism(outline: &[[f64; 2]], turn: &Quat, first: usize) -> String {
    let count = outline.len();
    let mut text = String::new();
    for z in [0.0, 1.0] {
        for [x, y] in outline {
            let v = turn * Vec3::new(*x, *y, z);
            text += &format!("v {} {} {}\n", v.x, v.y, v.z);
        }
    }
    let cap = |corner: &dyn Fn(usize) -> usize| {
        (0..count).map(|index| format!(" {}", corner((index + first) % count))).collect::<String>()
    };
    text += &format!("f{}\nf{}\n", cap(&|index| count + index + 1), cap(&|index| count - index));
    for index in 0..count {
        let next = (index + 1) % count;
        let wall = [index, next, count + next, count + index].map(|vertex| vertex + 1);
        text += &format!("f {} {} {} {}\n", wall[0], wall[1], wall[2], wall[3]);
    }
    text
}

/// The volume of a mesh without its rounding.
fn rounded_volume(mesh: &Mesh) -> f64 {
    (1e9 * mesh.volume()).round() / 1e9
}

/// Checks volume and area of the solid of a prism: triangles beyond its outline would add area.
fn check_prism(name: &str, outline: &[[f64; 2]], area: f64, perimeter: f64) {
    let mut rng = rng();
    for first in 0..outline.len() {
        for turn in [
            Quat::identity(),
            Quat::from_axis_angle(&Vec3::x_axis(), 0.5 * std::f64::consts::PI),
            Quat::from_euler_angles(rng.random(), rng.random(), rng.random()),
        ] {
            let mesh = read_obj(&prism(outline, &turn, first)).expect("a prism");
            let Ok(Shape::Mesh(solid)) = Shape::from_mesh(mesh) else { panic!("{name} {first} {turn}") };
            let mesh = solid.mesh();
            let errors = [mesh.volume() - area, mesh.area() - 2.0 * area - perimeter];
            assert!(errors.iter().all(|error| error.abs() < 1e-5), "{name} {first} {turn}: {errors:?}");
        }
    }
}

#[test]
fn concave_polygons_are_cut_within_their_outline_in_any_plane() {
    let u = [[0.0, 0.0], [6.0, 0.0], [6.0, 5.0], [4.0, 5.0], [4.0, 2.0], [2.0, 2.0], [2.0, 5.0], [0.0, 5.0]];
    check_prism("u", &u, 24.0, 28.0);
    let straight =
        [[0.0, 0.0], [3.0, 0.0], [6.0, 0.0], [6.0, 4.0], [3.0, 4.0], [3.0, 1.0], [3.0, 0.5], [0.0, 4.0]];
    let perimeter = 6.0 + 4.0 + 3.0 + 3.5 + (9.0_f64 + 3.5 * 3.5).sqrt() + 4.0;
    check_prism("collinear corners", &straight, 18.75, perimeter);
    let star: Vec<[f64; 2]> = (0..14)
        .map(|corner| {
            let (angle, radius) =
                (f64::from(corner) * std::f64::consts::PI / 7.0, 1.0 + f64::from(corner % 2));
            [radius * angle.cos(), radius * angle.sin()]
        })
        .collect();
    let area = 7.0 * 2.0 * (std::f64::consts::PI / 7.0).sin();
    let edge = (1.0 + 4.0 - 4.0 * (std::f64::consts::PI / 7.0).cos()).sqrt();
    check_prism("star", &star, area, 14.0 * edge);
}

#[test]
fn polygons_may_lead_around_a_hole() {
    // A plate of edge 4 with a square hole of edge 2; an edge of its caps leads to the hole and back.
    let mut text = String::new();
    for z in [0, 1] {
        for [x, y] in [[0, 0], [4, 0], [4, 4], [0, 4], [1, 1], [3, 1], [3, 3], [1, 3]] {
            text += &format!("v {x} {y} {z}\n");
        }
    }
    text += "f 9 10 11 12 9 13 16 15 14 13\nf 1 5 6 7 8 5 1 4 3 2\n";
    for (start, sign) in [(1, 1), (5, -1)] {
        for corner in 0..4 {
            let (a, b) = (start + corner, start + (corner + 1) % 4);
            let (a, b) = if sign > 0 { (a, b) } else { (b, a) };
            text += &format!("f {a} {b} {} {}\n", b + 8, a + 8);
        }
    }
    let Ok(Shape::Mesh(solid)) = Shape::from_mesh(read_obj(&text).expect("a plate")) else {
        panic!("closed")
    };
    assert_eq!((rounded_volume(solid.mesh()), solid.mesh().area()), (12.0, 2.0 * 12.0 + 16.0 + 8.0));
}

#[test]
fn obj_text_may_have_any_encoding_line_ends_and_continued_lines() {
    let cube = read_obj(CUBE).expect("a cube");
    let utf16 = |unit: fn(u16) -> [u8; 2]| {
        let text = format!("\u{feff}# µ, 立方体\n{CUBE}");
        text.encode_utf16().flat_map(unit).collect::<Vec<u8>>()
    };
    for (name, bytes) in [
        ("CRLF", CUBE.replace('\n', "\r\n").into_bytes()),
        ("CR", CUBE.replace('\n', "\r").into_bytes()),
        ("UTF-8", format!("\u{feff}o 立方体\n{CUBE}").into_bytes()),
        ("UTF-16, little endian", utf16(u16::to_le_bytes)),
        ("UTF-16, big endian", utf16(u16::to_be_bytes)),
        ("Latin-1", [b"g W\xfcrfel \xd8\n", CUBE.as_bytes()].concat()),
        ("continued", CUBE.replace(" 1 ", " \\\n 1 \\ \n").replace("f 4", "f\\\r\n4").into_bytes()),
        ("no last line end", CUBE.trim_end().to_owned().into_bytes()),
    ] {
        let mesh = import(&bytes, MeshFormat::Obj, &METRES);
        assert_eq!(mesh.as_ref(), Ok(&cube), "{name}");
    }
}

#[test]
fn names_in_latin_1_are_those_of_their_materials_and_images() {
    let obj = [
        b"mtllib c.mtl\nvt 0 0\nusemtl gr\xfcn\n",
        CUBE.replace("f 4 3 2 1", "f 4/1 3/1 2/1 1/1").as_bytes(),
    ]
    .concat();
    let obj = [&obj[..], b"usemtl gr\xfan\nf 1 2 3\n"].concat();
    let obj = [&obj[..], b"usemtl\nf 1 2 3\n"].concat();
    let mtl = b"newmtl gr\xfan\nKd \\\n0 1 0\nnewmtl gr\xfcn\nKd 0 0 1\n";
    let colours = import_colours(&obj, MeshFormat::Obj, &|_| Ok(mtl.to_vec())).expect("materials");
    assert_eq!(
        (&colours.material_ids[..1], &colours.material_ids[12..]),
        (&[1][..], &[0, 2][..]),
        "2: no name"
    );
    assert_eq!(colours.materials[0].albedo, [0.0, 1.0, 0.0]);
}

#[test]
fn utf_16_with_a_lone_surrogate_is_refused_with_its_line() {
    let cut = &[0xff, 0xfe, b'v', 0, b'\n', 0, 0, 0xd8, b'\n', 0];
    let error = import(cut, MeshFormat::Obj, &METRES).expect_err("a lone surrogate").to_string();
    assert!(error.contains("line 2 has a character that is not text"), "{error}");
}

/// The facets of a cube as text, moved along x.
fn facets(x: f64) -> String {
    let mesh = read_obj(CUBE).expect("a cube");
    let facet = |t: &[u32; 3]| {
        let vertex = |v: &u32| {
            let v = mesh.vertices[*v as usize];
            format!("vertex {:e} {} {}\n", v.x + x, v.y, v.z)
        };
        format!(
            "facet normal 0 0 0\nouter loop\n{}endloop\nendfacet\n",
            t.iter().map(vertex).collect::<String>()
        )
    };
    mesh.triangles.iter().map(facet).collect()
}

#[test]
fn every_solid_of_an_stl_text_is_read() {
    let (near, far) = (facets(0.0), facets(3.0));
    let read = |text: &str| import(text.as_bytes(), MeshFormat::Stl, &METRES);
    for text in [
        format!("solid a\n{near}endsolid a\nsolid b\n{far}endsolid b\n"),
        format!("solid\n{near}endsolid\n\nsolid\n{far}").replace('\n', "\r\n"),
        format!("SOLID a vertex of two\n{}EndSolid A\nSolid b\n{}", near.to_uppercase(), far.to_uppercase()),
        format!("\u{feff}  solid\t(c) 立方体\n# vertex 1 2 3\n{near}endsolid\n;\nsolid\n{far}endsolid"),
        format!("# by hand\nsolid a\n{near}{far}"),
        format!("solid\n{}", format!("{near}{far}").replace('\n', " ")),
    ] {
        let mesh = read(&text).expect("two cubes");
        let size = Aabb::from_points(&mesh.vertices).expect("corners").size();
        assert_eq!((rounded_volume(&mesh), size), (2.0, Vec3::new(4.0, 1.0, 1.0)), "{}", &text[..60]);
        assert!(Shape::from_mesh(mesh).is_ok());
    }
    for (from, to, expected) in [
        ("vertex 1e0 1 1", "vertex 1e0 1,5 1", "line 20: vertex needs three numbers"),
        ("vertex 1e0 1 1\nendloop", "endloop", "line 21: the facet above has not three vertices"),
        (
            "endloop\nendfacet\nfacet",
            "vertex 1 1 1\nendloop\nendfacet\nfacet",
            "line 9: the facet above has not three",
        ),
    ] {
        let text = format!("solid a\n{near}endsolid\n").replacen(from, to, 1);
        assert_ne!(text.len(), near.len() + 17, "{from}");
        let error = read(&text).expect_err(to).to_string();
        assert!(error.starts_with(&format!("cannot be read as STL: {expected}")), "{error}\n{text}");
    }
    let cut = read(&format!("solid\n{}", &near.rsplit_once("vertex").expect("a vertex").0))
        .expect_err("cut")
        .to_string();
    assert!(cut.contains("it ends within a facet"), "{cut}");
    assert_eq!(read("solid nothing\nendsolid\n"), Err(MeshError::Empty.into()));
}

#[test]
fn binary_stl_files_are_known_by_their_bytes_and_may_count_too_few_triangles() {
    let cube = read_obj(CUBE).expect("a cube");
    let whole = stl(&cube);
    let with = |header: &[u8], count: u32, tail: &[u8]| {
        let mut bytes = [&whole[..], tail].concat();
        bytes[..header.len()].copy_from_slice(header);
        bytes[80..84].copy_from_slice(&count.to_le_bytes());
        import(&bytes, MeshFormat::Stl, &METRES).map(|mesh| rounded_volume(&mesh))
    };
    let words = format!("{:80}", "solid cube facet normal 0 0 0 outer loop vertex 1 2 3");
    for header in [b"solid".as_slice(), words.as_bytes(), b"SOLID \xfc", b"COLOR=\xff\xff\xff\xff"] {
        assert_eq!(with(header, 12, &[]), Ok(1.0));
        assert_eq!(with(header, 0, &[]), Ok(1.0));
        assert_eq!(with(header, 11, &[]), Ok(1.0));
        assert_eq!(with(header, 12, b"\0\0more"), Ok(1.0));
        assert_eq!(with(header, 13, &[]), Err(MeshImportError::Length { declared: 734, actual: 684 }));
        assert_eq!(with(header, 12, &[1; 60]), Err(MeshImportError::Length { declared: 684, actual: 744 }));
    }
}

/// A cube whose triangles share no vertices, each of which is off by up to `offset` along every
/// axis, with texture coordinates.
fn cracked(offset: f64, seed: u64) -> Mesh {
    let cube = read_obj(CUBE).expect("a cube");
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let shift = Vec3::from_fn(|_, _| rng.random());
    let corners = cube.triangles.iter().flatten();
    let place = |v: &u32| {
        cube.vertices[*v as usize] + shift + Vec3::from_fn(|_, _| offset * rng.random_range(-1.0..1.0))
    };
    let vertices: Vec<Vec3> = corners.map(place).collect();
    let triangles = (0..12).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    let uvs = (0..12).map(|t| [[f64::from(t), 0.0], [0.0, f64::from(t)], [0.5, 0.5]]).collect();
    Mesh { vertices, triangles, uvs }
}

#[test]
fn vertices_within_a_millionth_of_the_diagonal_are_one_wherever_they_lie() {
    // The largest distance is 2 √3 offsets, and the diagonal √3.
    for seed in 0..200 {
        let mesh = cracked(0.49e-6, seed);
        let Ok(Shape::Mesh(solid)) = Shape::from_mesh(mesh.clone()) else { panic!("seed {seed}: open") };
        assert_eq!(
            (solid.mesh().vertices.len(), &solid.mesh().uvs),
            (8, &mesh.uvs),
            "seams keep their coordinates"
        );
        assert!((solid.mesh().volume() - 1.0).abs() < 1e-5);
    }
    assert!(matches!(Shape::from_mesh(cracked(1e-5, 0)), Err(MeshError::Open { .. })));
}

#[test]
fn a_closed_mesh_keeps_vertices_that_are_close() {
    // A tetrahedron with a corner cut off 4e-7 from its tip.
    let e = 4e-7;
    let text = format!(
        "v 0 0 {h}\nv {e} 0 {h}\nv 0 {e} {h}\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 4 6 5\nf 4 5 2 1\nf 5 6 3 2\nf 6 4 1 3\n",
        h = 1.0 - e
    );
    let Ok(Shape::Mesh(solid)) = Shape::from_mesh(read_obj(&text).expect("a mesh")) else { panic!("closed") };
    assert_eq!(solid.mesh().vertices.len(), 6);
}

#[test]
fn scale_is_applied_and_y_is_up_in_glb_files_and_z_in_others_unless_stated() {
    let text = CUBE.replace("v 0 0 1", "v 0 0 3").replace("v 1 0 1", "v 1 0 3").replace("v 1 1 1", "v 1 1 3");
    let brick = read_obj(&text.replace("v 0 1 1", "v 0 1 3")).expect("a brick");
    let glb = Glb::new(&brick).bytes();
    let size = |bytes: &[u8], format, z_up| {
        let mesh = import(bytes, format, &MeshImportOptions { scale: 0.125, z_up }).expect("a brick");
        assert!(mesh.volume() > 0.0);
        Aabb::from_points(&mesh.vertices).expect("corners").size() / 0.125
    };
    let (tall, lying) = (Vec3::new(1.0, 1.0, 3.0), Vec3::new(1.0, 3.0, 1.0));
    assert_eq!(
        [None, Some(false), Some(true)].map(|up| size(&glb, MeshFormat::Gltf, up)),
        [lying, lying, tall]
    );
    assert_eq!(
        [None, Some(false), Some(true)].map(|up| size(&stl(&brick), MeshFormat::Stl, up)),
        [tall, lying, tall]
    );
}

#[test]
fn mirrored_nodes_and_nodes_of_the_default_scene_are_read() {
    let cube = Glb::new(&read_obj(CUBE).expect("a cube"));
    let json = cube
        .json
        .replace("\"translation\":[1,0,0]", "\"translation\":[1,0,0],\"scale\":[-2,1,1]")
        .replace("\"scenes\":[{\"nodes\":[0]}]", "\"scenes\":[{\"nodes\":[]},{\"nodes\":[0]}]")
        .replace("\"scene\":0", "\"scene\":1");
    let mesh = import(&Glb { json, ..cube }.bytes(), MeshFormat::Gltf, &METRES).expect("a brick");
    let bounds = Aabb::from_points(&mesh.vertices).expect("corners");
    assert_eq!((rounded_volume(&mesh), bounds.size().x, bounds.centre().x), (2.0, 2.0, 0.0));
}
