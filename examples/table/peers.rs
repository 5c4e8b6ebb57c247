//! The peers: Draco (crate `draco-core`) and meshoptimizer (crate `meshopt`), on the arrays that unweld gets.

use super::made::compact;
use anyhow::Context;
use draco_core::{
    DataType, DecoderBuffer, EncoderBuffer, EncoderOptions, GeometryAttributeType, Mesh, MeshDecoder,
    MeshEncoder, PointAttribute,
};
use meshopt::SimplifyOptions;
use unweld::codec::grid::Real;
use unweld::mesh::{IndexedMesh, Lattice, lattice};

/// A mesh as Draco wants it. Its positions are those of unweld's lattice, in steps: Draco's own lattice over them, with as
/// many bits, is the same one.
pub struct Draco {
    mesh: Mesh,
    bits: u32,
}

impl Draco {
    /// # Errors
    /// Where there are no triangles.
    pub fn new(mesh: &IndexedMesh, bits: u32) -> anyhow::Result<Self> {
        let lattice = lattice_of(mesh, bits)?;
        let on_lattice = mesh.positions.iter().flat_map(|&p| lattice.quantise(p));
        let bytes: Vec<u8> = on_lattice.flat_map(|x| (x as f32).to_le_bytes()).collect();
        let mut positions = PointAttribute::new();
        let count = mesh.positions.len();
        positions.init(GeometryAttributeType::Position, 3, DataType::Float32, false, count);
        positions.buffer_mut().write(0, &bytes);
        let mut peer = Mesh::new();
        peer.set_num_points(count);
        peer.add_attribute(positions);
        peer.set_num_faces(mesh.triangles.len());
        peer.set_faces_from_flat_indices(mesh.triangles.as_flattened());
        Ok(Self { mesh: peer, bits })
    }

    /// An encoder that has the mesh.
    pub fn encoder(&self) -> MeshEncoder {
        let mut encoder = MeshEncoder::new();
        encoder.set_mesh(self.mesh.clone());
        encoder
    }

    /// Edgebreaker at compression level 10, the smallest.
    ///
    /// # Errors
    /// Those of Draco.
    pub fn encode(&self, mut encoder: MeshEncoder) -> anyhow::Result<Vec<u8>> {
        let mut options = EncoderOptions::new();
        options.set_compression_level(10);
        options.set_attribute_quantization(0, self.bits as i32);
        let mut out = EncoderBuffer::new();
        encoder.encode(&options, &mut out).context("Draco cannot encode this")?;
        Ok(out.data().to_vec())
    }

    /// Decodes.
    ///
    /// # Errors
    /// Those of Draco.
    pub fn decode(bytes: &[u8]) -> anyhow::Result<Mesh> {
        let mut mesh = Mesh::new();
        MeshDecoder::new()
            .decode(&mut DecoderBuffer::new(bytes), &mut mesh)
            .context("Draco cannot decode")?;
        Ok(mesh)
    }
}

/// Bytes of Draco's file of a mesh whose coordinates it keeps as they are: Edgebreaker at compression level 10. `None` where
/// it cannot encode it.
pub fn draco_without_quantisation(mesh: &IndexedMesh, real: Real) -> Option<usize> {
    let (kind, bytes): (_, Vec<u8>) = match real {
        Real::Binary32 => (
            DataType::Float32,
            mesh.positions.iter().flatten().flat_map(|&x| (x as f32).to_le_bytes()).collect(),
        ),
        Real::Binary64 => {
            (DataType::Float64, mesh.positions.iter().flatten().flat_map(|x| x.to_le_bytes()).collect())
        }
    };
    let mut positions = PointAttribute::new();
    positions.init(GeometryAttributeType::Position, 3, kind, false, mesh.positions.len());
    positions.buffer_mut().write(0, &bytes);
    let mut peer = Mesh::new();
    peer.set_num_points(mesh.positions.len());
    peer.add_attribute(positions);
    peer.set_num_faces(mesh.triangles.len());
    peer.set_faces_from_flat_indices(mesh.triangles.as_flattened());
    let mut encoder = MeshEncoder::new();
    encoder.set_mesh(peer);
    let mut options = EncoderOptions::new();
    options.set_compression_level(10);
    let mut out = EncoderBuffer::new();
    encoder.encode(&options, &mut out).ok()?;
    Draco::decode(out.data()).ok()?;
    Some(out.data().len())
}

/// `meshopt_simplify` to so many triangles, whatever the error, boundaries not locked; on the vertices of `mesh`. `None` where it stops
/// before.
pub fn meshopt_simplify(mesh: &IndexedMesh, triangles: usize) -> Option<IndexedMesh> {
    let (min, _) = lattice::bounds(mesh.positions.iter().copied())?;
    let near_origin = |p: &[f64; 3]| std::array::from_fn(|k| (p[k] - min[k]) as f32);
    let positions: Vec<[f32; 3]> = mesh.positions.iter().map(near_origin).collect();
    let indices = meshopt::simplify_decoder(
        mesh.triangles.as_flattened(),
        &positions,
        triangles * 3,
        f32::MAX,
        SimplifyOptions::None,
        None,
    );
    let simplified: Vec<[u32; 3]> = indices.as_chunks().0.to_vec();
    (simplified.len() <= triangles && !simplified.is_empty())
        .then(|| IndexedMesh::new(mesh.positions.clone(), simplified))
}

/// `meshopt_simplifyWithUpdate` to so many triangles, whatever the error, boundaries not locked: it moves the vertices that stay to where
/// the error is least. `None` where it stops before.
pub fn meshopt_simplify_with_update(mesh: &IndexedMesh, triangles: usize) -> Option<IndexedMesh> {
    let (min, _) = lattice::bounds(mesh.positions.iter().copied())?;
    let near_origin = |p: &[f64; 3]| std::array::from_fn(|k| (p[k] - min[k]) as f32);
    let mut positions: Vec<[f32; 3]> = mesh.positions.iter().map(near_origin).collect();
    let mut indices = mesh.triangles.as_flattened().to_vec();
    let count = meshopt::simplify_with_update(
        &mut indices,
        &mut positions,
        &mut [],
        &[],
        0,
        None,
        triangles * 3,
        f32::MAX,
        SimplifyOptions::None,
        None,
    );
    indices.truncate(count);
    let simplified: Vec<[u32; 3]> = indices.as_chunks().0.to_vec();
    let back = |p: &[f32; 3]| std::array::from_fn(|k| f64::from(p[k]) + min[k]);
    (simplified.len() <= triangles && !simplified.is_empty())
        .then(|| compact(&IndexedMesh::new(positions.iter().map(back).collect(), simplified)))
}

/// A mesh with its vertices on the lattice of so many bits over it.
///
/// # Errors
/// Where there are no vertices.
pub fn on_lattice(mesh: &IndexedMesh, bits: u32) -> anyhow::Result<IndexedMesh> {
    let lattice = lattice_of(mesh, bits)?;
    let positions = mesh.positions.iter().map(|&p| lattice.position(lattice.quantise(p))).collect();
    Ok(IndexedMesh::new(positions, mesh.triangles.clone()))
}

/// The lattice that unweld uses for a mesh of which all vertices are in triangles.
fn lattice_of(mesh: &IndexedMesh, bits: u32) -> anyhow::Result<Lattice> {
    let (min, max) = lattice::bounds(mesh.positions.iter().copied()).context("no vertices")?;
    Ok(Lattice::over(min, max, bits))
}

#[cfg(test)]
mod tests {
    use super::*;
    use unweld::mesh::shapes;

    #[test]
    fn draco_brings_all_triangles_back() {
        let mesh = shapes::bumpy_sphere(4, 1);
        let draco = Draco::new(&mesh, 12).unwrap();
        let bytes = draco.encode(draco.encoder()).unwrap();
        let back = Draco::decode(&bytes).unwrap();
        assert_eq!(back.num_faces(), mesh.triangles.len());
        assert!(bytes.len() < mesh.positions.len() * 4, "{}", bytes.len());
        // The lattice is the same one: all positions come back as they went in, in another order.
        let count = mesh.positions.len();
        let attribute = |mesh: &Mesh| -> Vec<[i32; 3]> {
            let values = mesh.attribute(0).read_f32s(count, 3);
            let mut points: Vec<[i32; 3]> =
                values.as_chunks().0.iter().map(|p: &[f32; 3]| p.map(|x| x as i32)).collect();
            points.sort_unstable();
            points
        };
        assert_eq!(attribute(&back), attribute(&draco.mesh));
    }

    #[test]
    fn meshopt_reaches_a_target_or_says_that_it_does_not() {
        let sphere = shapes::sphere(4);
        let small = meshopt_simplify(&sphere, 200).unwrap();
        assert!((100..=200).contains(&small.triangles.len()));
        let moved = meshopt_simplify_with_update(&sphere, 200).unwrap();
        assert!((100..=200).contains(&moved.triangles.len()));
        assert!(moved.positions.iter().any(|p| !sphere.positions.contains(p)));
        assert!(meshopt_simplify(&shapes::tetrahedron(), 1).is_none());
    }
}
