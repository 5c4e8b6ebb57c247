use super::super::tests::{ALL, METHODS, reduced};
use super::super::{Edition, Options, Topology, reduce};
use crate::error::Error;
use crate::mesh::attributes::{Attribute, NO_VALUE, Semantic, Values};
use crate::mesh::random::SplitMix64;
use crate::mesh::{IndexedMesh, shapes};
use glam::DVec3;

/// A sheet of squares, bent a little, with texture coordinates that are linear in its places and start anew to the right of a column, where
/// another part begins, too.
fn sheet(n: u32, column: f64, height: f64) -> IndexedMesh {
    let mut mesh = shapes::grid(n, n);
    let mut random = SplitMix64::new(3);
    for (k, p) in (0..).zip(&mut mesh.positions) {
        let [x, y] = [f64::from(k % (n + 1)), f64::from(k / (n + 1))];
        *p = [x, y, height * random.unit()];
    }
    let (mut numbers, mut corners, mut parts) = (Vec::new(), Vec::new(), Vec::new());
    for t in &mesh.triangles {
        let side = u32::from(t.iter().map(|&v| mesh.positions[v as usize][0]).sum::<f64>() / 3.0 > column);
        parts.push(side);
        for &v in t {
            let [x, y, _] = mesh.positions[v as usize];
            corners.push(numbers.len() as u32 / 2);
            numbers.extend([x + 100.0 * f64::from(side), 2.0 * y - x]);
        }
    }
    mesh.attributes =
        vec![Attribute::new(Semantic::TexCoord, 2, Values::F64(numbers), corners), Attribute::parts(&parts)];
    mesh.part_names = vec!["left".to_owned(), "right".to_owned()];
    mesh
}

/// Each triangle's corners and part, as they were made: on which side it is, and whether its values are those of its places.
fn check_sheet(mesh: &IndexedMesh, column: f64, off: f64) {
    assert!(mesh.attributes.iter().all(|a| a.check(mesh.triangles.len()) == Ok(())));
    let [uv, parts] = &mesh.attributes[..] else { panic!("{}", mesh.attributes.len()) };
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        let side = parts.values.number(parts.at(t, 0).unwrap());
        for (k, &v) in triangle.iter().enumerate() {
            let [x, y, _] = mesh.positions[v as usize];
            let at = 2 * uv.at(t, k).unwrap();
            let [u, w] = [uv.values.number(at), uv.values.number(at + 1)];
            assert!(
                (u - 100.0 * side - x).abs() <= off && (w - (2.0 * y - x)).abs() <= off,
                "{u} {w} at {x} {y}"
            );
            let outside = if side == 1.0 { column - x } else { x - column };
            assert!(outside < 1e-6, "{x} is beyond {column}");
        }
    }
}

#[test]
fn a_flat_chart_stays_linear_and_its_seam_in_its_place() {
    let mesh = sheet(16, 6.0, 0.0);
    check_sheet(&mesh, 6.0, 0.0);
    for method in METHODS {
        let small = reduced(&mesh, 40, &Options { method, ..Options::default() }).mesh;
        assert!(small.triangles.len() <= 40, "{method:?}: {}", small.triangles.len());
        check_sheet(&small, 6.0, 1e-6);
        assert_eq!(small.part_names, mesh.part_names);
    }
}

/// Cells may have a part on either side; but each triangle has values of one.
#[test]
fn clusters_do_not_mix_what_a_seam_parts() {
    let mesh = sheet(24, 6.5, 0.0);
    for method in ALL {
        let small = reduced(&mesh, 100, &Options { method, ..Options::default() }).mesh;
        let [uv, parts] = &small.attributes[..] else { panic!() };
        for t in 0..small.triangles.len() {
            let side = parts.values.number(parts.at(t, 0).unwrap());
            let u = [0, 1, 2].map(|k| uv.values.number(2 * uv.at(t, k).unwrap()));
            assert!(u.iter().all(|u| (u / 100.0).round() == side), "{method:?}: {u:?} in part {side}");
        }
    }
}

#[test]
fn what_need_not_go_keeps_its_values() {
    let mesh = sheet(5, 2.0, 1.0);
    for method in ALL {
        assert_eq!(reduced(&mesh, 1000, &Options { method, ..Options::default() }).mesh, mesh, "{method:?}");
    }
}

#[test]
fn normals_have_length_1_and_fit_the_surface() {
    let mut mesh = shapes::sphere(4);
    let numbers =
        mesh.positions.iter().flat_map(|p| (DVec3::from(*p).normalize()).to_array().map(|x| x as f32));
    let corners = mesh.triangles.as_flattened().to_vec();
    mesh.attributes = vec![Attribute::new(Semantic::Normal, 3, Values::F32(numbers.collect()), corners)];
    for method in ALL {
        let small = reduced(&mesh, 300, &Options { method, ..Options::default() }).mesh;
        let normals = &small.attributes[0];
        for (t, triangle) in small.triangles.iter().enumerate() {
            for (k, &v) in triangle.iter().enumerate() {
                let at = 3 * normals.at(t, k).unwrap();
                let normal = DVec3::from([0, 1, 2].map(|k| normals.values.number(at + k)));
                assert!((normal.length() - 1.0).abs() < 1e-6, "{method:?}");
                let up = DVec3::from(small.positions[v as usize]).normalize();
                assert!(normal.dot(up) > 0.98, "{method:?}: {}", normal.dot(up));
            }
        }
    }
}

/// A flat sheet may lose everything but for a ridge of its colours, along which vertices have to stay.
#[test]
fn where_colours_bend_vertices_stay() {
    let mut mesh = shapes::grid(30, 30);
    mesh.positions.iter_mut().for_each(|p| p[2] = 0.0);
    let bent = |p: &[f64; 3]| 1.0 - 0.1 * (p[0] + p[1] - 30.0).abs().min(5.0);
    let colours = Values::F64(mesh.positions.iter().flat_map(|p| [bent(p); 3]).collect());
    let corners = mesh.triangles.as_flattened().to_vec();
    let bare = mesh.clone();
    mesh.attributes = vec![Attribute::new(Semantic::Color, 3, colours, corners)];
    let near = |mesh: &IndexedMesh| {
        let near = mesh.positions.iter().filter(|p| (p[0] + p[1] - 30.0).abs() <= 6.0).count();
        near as f64 / mesh.positions.len() as f64
    };
    for method in METHODS {
        let [with, without] = [&mesh, &bare]
            .map(|mesh| near(&reduced(mesh, 100, &Options { method, ..Options::default() }).mesh));
        assert!(with > 0.6 && with > without, "{method:?}: {with}, {without}");
    }
}

#[test]
fn odd_values() {
    let mut random = SplitMix64::new(1);
    for mesh in [shapes::torus(12, 9), shapes::grid(9, 9), shapes::handle_body(2)] {
        let mut mesh = mesh;
        let count = 3 * mesh.triangles.len();
        let mut of = |semantic, components: usize, values: Values| {
            let most = (values.len() / components) as u32;
            let corners =
                (0..count).map(|_| random.below(most + 1)).map(|v| if v == most { NO_VALUE } else { v });
            Attribute::new(semantic, components, values, corners.collect())
        };
        let strange = vec![f32::NAN, 1e38, -1e38, f32::INFINITY, 0.0, 1.0];
        mesh.attributes = vec![
            of(Semantic::TexCoord, 2, Values::F32(strange.clone())),
            of(Semantic::Normal, 3, Values::F32(vec![0.0, 0.0, 0.0, 1e30, 0.0, 0.0])),
            of(Semantic::Color, 3, Values::U8(vec![255, 0, 0])),
            of(Semantic::Joints, 4, Values::U16(vec![1, 2, 3, 4])),
            of(Semantic::Generic, 1, Values::F64(vec![7.0])),
            of(Semantic::Tangent, 4, Values::F32(vec![0.0, 1.0, 0.0, -1.0])),
        ];
        for (method, topology) in
            ALL.into_iter().flat_map(|method| [(method, Topology::Keep), (method, Topology::Free)])
        {
            let small = reduced(&mesh, 20, &Options { method, topology, ..Options::default() }).mesh;
            assert_eq!(small.attributes.len(), mesh.attributes.len());
            assert!(small.attributes.iter().all(|a| a.check(small.triangles.len()) == Ok(())), "{method:?}");
        }
    }
    let mut mesh = sheet(3, 1.0, 0.0);
    let edition = Options { edition: Some(Edition::Of2006), ..Options::default() };
    assert!(reduced(&mesh, 8, &edition).mesh.attributes.is_empty());
    mesh.attributes[0].corners.pop();
    assert!(matches!(reduce(&mesh, 8, &Options::default(), &mut |_, _| true), Err(Error::Parameter(_))));
}
