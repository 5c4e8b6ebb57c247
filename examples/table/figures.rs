//! The figures that matter, and what they are to be.

/// A figure: the column of a table, over its rows.
pub struct Figure {
    /// What it tells.
    pub what: &'static str,
    /// Where it stands: title and head.
    pub table: &'static str,
    pub column: &'static str,
    /// How it is written.
    pub decimals: usize,
    /// The only row that counts, by the start of its name, where not all do.
    pub row: &'static str,
    /// The geometric mean to be reached.
    pub mean: Option<f64>,
    /// What no row is to be above.
    pub most: Option<f64>,
}

/// A figure of all rows of a table.
const fn figure(
    what: &'static str,
    table: &'static str,
    column: &'static str,
    decimals: usize,
    mean: Option<f64>,
    most: Option<f64>,
) -> Figure {
    Figure { what, table, column, decimals, row: "", mean, most }
}

/// What and where; decimals, the mean to be reached, the largest allowed.
pub const FIGURES: [Figure; 41] = [
    figure("bytes over Draco's, 12 bits", "Sizes", "bytes/Draco", 2, Some(1.12), Some(1.30)),
    figure("bytes over Draco's, profile small", "Sizes", "small/Draco", 2, Some(1.05), None),
    figure(
        "bytes over Draco's, generated meshes",
        "Structured meshes",
        "bytes/Draco",
        2,
        Some(0.85),
        Some(1.25),
    ),
    figure("bytes over Draco's, small meshes, 14 bits", "Small meshes", "bytes/Draco", 2, Some(1.08), None),
    figure(
        "bytes over Draco's, meshes that nothing was chosen on",
        "Acceptance",
        "bytes/Draco",
        2,
        Some(1.25),
        Some(1.60),
    ),
    figure("bytes over Draco's, dragon, 14 bits", "The dragon", "bytes/Draco", 2, None, None),
    figure(
        "bytes over Draco's, models with attributes",
        "Attributes",
        "bytes/Draco",
        2,
        Some(1.15),
        Some(1.30),
    ),
    figure("their attributes over Draco's", "Attributes", "attributes/Draco", 2, None, None),
    figure("bytes over gltfpack's and brotli's", "Attributes", "bytes/gltfpack", 2, Some(0.75), None),
    figure(
        "bytes over the best progressive coder's",
        "Progressive coders",
        "bytes/best",
        2,
        Some(0.85),
        None,
    ),
    Figure {
        row: "organic_cat",
        ..figure(
            "header, table and metadata of a mesh of 8,000 vertices, bytes",
            "Sizes",
            "frame",
            0,
            Some(350.0),
            None,
        )
    },
    figure("their share of the file in percent, 12 bits", "Sizes", "frame %", 1, None, Some(3.0)),
    figure("their share, generated meshes", "Structured meshes", "frame %", 1, None, Some(3.0)),
    figure("their share, small meshes", "Small meshes", "frame %", 1, None, Some(3.0)),
    figure("their share, meshes that nothing was chosen on", "Acceptance", "frame %", 1, None, Some(3.0)),
    figure("bits a triangle of a keyframe's connectivity", "Keyframe of level 0", "sum", 4, None, None),
    figure(
        "exact and in order, over the best of xz and zstd",
        "Exact coordinates, and the order of the input",
        "in order/best",
        2,
        None,
        None,
    ),
    figure(
        "error of prefixes of equal bytes, over an earlier version's",
        "Prefixes beside an earlier version's",
        "error/earlier",
        2,
        Some(0.75),
        Some(1.10),
    ),
    figure(
        "error of prefixes, over simplified meshes coded by Draco to as many bytes",
        "Prefixes beside single-rate files",
        "error/single",
        2,
        None,
        None,
    ),
    figure(
        "the same over HQMS' meshes, estimated",
        "Prefixes beside HQMS coded by Draco",
        "error/HQMS",
        2,
        Some(1.60),
        None,
    ),
    figure(
        "error over meshopt_simplify's, as many triangles",
        "Whole files",
        "error/meshopt",
        2,
        Some(1.0),
        None,
    ),
    figure("the same at 50 % of the triangles", "Whole files", "error 50 %", 2, None, None),
    figure("at 25 %", "Whole files", "25 %", 2, None, None),
    figure("at 10 %", "Whole files", "10 %", 2, None, None),
    figure("at 5 %", "Whole files", "5 %", 2, None, None),
    figure(
        "error over meshopt_simplify's on the lattice, CAD parts, 14 bits",
        "CAD parts",
        "error/meshopt",
        2,
        Some(1.4),
        None,
    ),
    Figure {
        row: "cad_fandisk",
        ..figure("the same, fandisk", "CAD parts", "error/meshopt", 2, Some(1.0), None)
    },
    figure(
        "mean error of hqms over qslim's, as many triangles",
        "HQMS beside other simplifiers",
        "mean/qslim",
        2,
        Some(0.90),
        Some(0.95),
    ),
    figure("its RMS over qslim's", "HQMS beside other simplifiers", "RMS/qslim", 2, None, Some(1.0)),
    figure(
        "its mean error over meshopt_simplify's",
        "HQMS beside other simplifiers",
        "mean/meshopt",
        2,
        Some(0.56),
        Some(0.62),
    ),
    figure("over stellar's", "HQMS beside other simplifiers", "mean/stellar", 2, None, Some(0.6)),
    figure(
        "bytes of memory a vertex of hqms",
        "HQMS beside other simplifiers",
        "B/vertex",
        0,
        None,
        Some(100.0),
    ),
    figure("its memory over qslim's", "HQMS beside other simplifiers", "B/qslim", 2, None, Some(0.4)),
    figure("encoding time over Draco's", "Whole files", "encode/Draco", 2, None, Some(6.5)),
    figure("encoding time over Draco's, dragon", "The dragon", "encode/Draco", 2, None, Some(6.5)),
    figure("decoding time over Draco's", "Whole files", "decode/Draco", 2, None, Some(2.4)),
    figure("decoding time over Draco's, dragon", "The dragon", "decode/Draco", 2, None, Some(2.4)),
    figure("bytes of memory a vertex, encoding", "Whole files", "encode B/vertex", 0, Some(300.0), None),
    figure(
        "bytes of memory a vertex, encoding, dragon",
        "The dragon",
        "encode B/vertex",
        0,
        Some(300.0),
        None,
    ),
    figure("bytes of memory a vertex, decoding", "Whole files", "decode B/vertex", 0, Some(150.0), None),
    figure(
        "bytes of memory a vertex, decoding, dragon",
        "The dragon",
        "decode B/vertex",
        0,
        Some(150.0),
        None,
    ),
];
