//! What there is to say about a file, for people and for programs.

use super::numbers::{count, grouped, of_diagonal, percent, significant, table};
use super::resources::Resources;
use super::uwm::Uwm;
use serde_json::{Map, Value, json};
use std::fmt::Write;
use std::sync::Arc;
use unweld::codec::residue::ResidueCounts;
use unweld::container::{AttributeEntry, AttributeError, Coding, Contents, Level, Metadata, VERSION};
use unweld::mesh::attributes::Semantic;

/// A file as its header, table of contents, metadata and residue tell of it.
pub struct Description {
    /// Header and table of contents.
    pub contents: Arc<Contents>,
    /// Metadata, if the file has any.
    pub metadata: Option<Metadata>,
    /// What level 0 has beyond the manifold.
    pub residue: ResidueCounts,
    /// What stands beside the mesh.
    pub resources: Resources,
}

impl Description {
    /// That of a file whose residue is known; metadata and scene are read, as far as it is not cut off before them.
    ///
    /// # Errors
    /// Those of reading the file.
    pub fn new(uwm: &mut Uwm, residue: ResidueCounts) -> anyhow::Result<Self> {
        let (metadata, scene) = (uwm.metadata()?, uwm.scene()?);
        let resources = Resources::new(&uwm.contents, scene.as_deref());
        Ok(Self { contents: uwm.contents.clone(), metadata, residue, resources })
    }

    /// Vertices that a full decode gives.
    pub fn vertices(&self) -> u64 {
        if self.keeps_order() && self.told("input_vertices") > 0 {
            return self.told("input_vertices");
        }
        let sewn = self.residue.grouped_vertices - self.residue.groups;
        let welded =
            u64::from(self.contents.header.vertices) + self.residue.extra_vertices as u64 - sewn as u64;
        if self.is_exact() { welded + self.told("copies") } else { welded }
    }

    /// Triangles that a full decode gives.
    pub fn triangles(&self) -> u64 {
        u64::from(self.contents.header.triangles) + self.residue.triangles as u64
    }

    /// Whether level 0 has the input's coordinates, bit for bit.
    pub fn is_exact(&self) -> bool {
        !self.contents.correction().is_empty()
    }

    /// Whether level 0 has the input's lists of vertices and triangles.
    pub fn keeps_order(&self) -> bool {
        !self.contents.order().is_empty()
    }

    /// The diagonal of the input's bounding box; that of the lattice where the metadata do not tell.
    pub fn diagonal(&self) -> f64 {
        diagonal(&self.contents, self.metadata.as_ref())
    }

    /// One JSON object; errors in the units of the mesh and in percent of the diagonal.
    pub fn json(&self) -> Map<String, Value> {
        let header = &self.contents.header;
        let object = json!({
            "format_version": VERSION,
            "generator": self.metadata.as_ref().map(|m| &m.generator),
            "file_bytes": self.contents.file_bytes(),
            "vertices": self.vertices(),
            "triangles": self.triangles(),
            "manifold": { "vertices": header.vertices, "triangles": header.triangles },
            "lattice": {
                "origin": header.lattice.origin,
                "step": header.lattice.step,
                "bits": header.lattice.bits,
            },
            "exact": self.is_exact(),
            "keep_order": self.keeps_order(),
            "coding": { "lifting": header.coding.lifting, "models": models(header.coding) },
            "levels": self.levels().map(|level| self.level_json(&level)).collect::<Vec<_>>(),
            "keyframes": self.keyframes().map(|(level, bytes)| json!({
                "level": level, "offset": bytes.start, "bytes": bytes.end - bytes.start,
            })).collect::<Vec<_>>(),
            "residue": {
                "bytes": self.bytes_of(self.contents.residue()),
                "triangles": self.residue.triangles,
                "stitched_groups": self.residue.groups,
                "reversed_triangles": self.residue.reversed_triangles,
                "extra_vertices": self.residue.extra_vertices,
            },
            "attributes": {
                "bytes": self.attribute_bytes(),
                "list": self.contents.attributes.iter().map(|attribute| json!({
                    "title": attribute.title(),
                    "semantic": attribute.semantic.name(),
                    "set": attribute.set,
                    "domain": attribute.domain.name(),
                    "components": attribute.components,
                    "stored": attribute.stored.name(),
                    "bits": attribute.bits(),
                    "birth": attribute.birth,
                    "constant": attribute.constant.is_some(),
                    "rms_error": attribute.error,
                })).collect::<Vec<_>>(),
            },
            "resources": self.resources.json(),
            "correction": { "bytes": self.bytes_of(self.contents.correction()) },
            "order": { "bytes": self.bytes_of(self.contents.order()) },
            "input": self.metadata.as_ref().map(|m| json!({
                "source": m.source,
                "float32": m.source_float32,
                "diagonal": m.diagonal_of(header),
                "conditioning": m.findings(header).into_iter().collect::<std::collections::BTreeMap<_, _>>(),
                "dropped": m.dropped,
                "settings": m.settings.iter().cloned().collect::<std::collections::BTreeMap<_, _>>(),
            })),
        });
        match object {
            Value::Object(map) => map,
            _ => Map::new(),
        }
    }

    fn level_json(&self, level: &LevelLine) -> Value {
        let born = self.contents.born(level.number);
        let entry = &self.contents.levels[level.number as usize];
        json!({
            "level": level.number,
            "vertices": entry.vertices,
            "triangles": entry.triangles,
            "born": { "vertices": born[0], "triangles": born[1] },
            "precision": entry.precision,
            "offset": level.offset,
            "bytes": level.bytes,
            "cumulative_bytes": level.offset + level.bytes,
            "max_error": entry.max_error,
            "rms_error": entry.rms_error,
            "max_error_percent": percent(entry.max_error, self.diagonal()),
            "rms_error_percent": percent(entry.rms_error, self.diagonal()),
            "attribute_errors": entry.attributes.iter().map(|error| json!({
                "title": self.contents.attributes[error.attribute].title(),
                "error": error.error,
                "high": error.high,
            })).collect::<Vec<_>>(),
        })
    }

    /// The levels as a table, coarse to fine.
    pub fn table(&self) -> String {
        let relative = self.diagonal() > 0.0;
        let unit = if relative { " %" } else { "" };
        let error = |x: f64| significant(percent(x, self.diagonal()).unwrap_or(x), 3) + unit;
        let heads = ["level", "vertices", "triangles", "bytes", "up to here", "max error", "rms error", ""];
        let mut lines = vec![heads.map(str::to_owned).to_vec()];
        let base = self.contents.base_level();
        for level in self.levels() {
            let entry = &self.contents.levels[level.number as usize];
            let mark = match self.contents.keyframe(level.number) {
                _ if level.number == base => "base",
                Some(_) => "key ",
                None => "",
            };
            lines.push(vec![
                level.number.to_string(),
                grouped(entry.vertices),
                grouped(entry.triangles),
                grouped(level.bytes),
                grouped(level.offset + level.bytes),
                error(entry.max_error),
                error(entry.rms_error),
                mark.to_owned(),
            ]);
        }
        table(&lines).lines().map(|line| line.trim_end().to_owned() + "\n").collect()
    }

    /// How far the attributes of levels are off, as a table, coarse to fine; empty where there is nothing to tell.
    pub fn attribute_table(&self) -> String {
        let told = |k: &usize| self.contents.levels.iter().any(|level| error_of(level, *k).is_some());
        let told: Vec<usize> = (0..self.contents.attributes.len()).filter(told).collect();
        if told.is_empty() {
            return String::new();
        }
        let mut heads = vec!["level".to_owned()];
        for entry in told.iter().map(|&k| &self.contents.attributes[k]) {
            match entry.semantic {
                Semantic::Part => heads.push(format!("another {}", entry.title())),
                _ => heads.extend([format!("{} error", entry.title()), "95 %".to_owned()]),
            }
        }
        let mut lines = vec![heads];
        for j in (1..self.contents.header.level_count).rev() {
            let level = &self.contents.levels[j as usize];
            let mut line = vec![j.to_string()];
            for &k in &told {
                let entry = &self.contents.attributes[k];
                let is_part = entry.semantic == Semantic::Part;
                let text = |x: f64| match () {
                    () if is_part => significant(100.0 * x, 3) + " %",
                    () if entry.is_of_directions() => significant(x, 3) + "°",
                    () => significant(x, 3),
                };
                let error = error_of(level, k);
                line.push(error.map_or(String::new(), |error| text(error.error)));
                if !is_part {
                    line.push(error.and_then(|error| error.high).map_or(String::new(), text));
                }
            }
            lines.push(line);
        }
        table(&lines).lines().map(|line| line.trim_end().to_owned() + "\n").collect()
    }

    /// Mesh, topology, lattice, residue and what was dropped, a line each.
    pub fn summary(&self) -> String {
        let header = &self.contents.header;
        let mut out = String::new();
        let mut line = |head: &str, text: &str| {
            let _ = writeln!(out, "  {head:<11}{text}");
        };
        line(
            "mesh",
            &format!("{}, {}", count(self.vertices(), "vertex"), count(self.triangles(), "triangle")),
        );
        if self.residue != ResidueCounts::default() {
            let manifold =
                format!("{}, {}", count(header.vertices, "vertex"), count(header.triangles, "triangle"));
            line("manifold", &manifold);
            line("residue", &self.residue_text());
        }
        if let Some(metadata) = &self.metadata {
            let told = |name: &str| self.told(name);
            let topology = [
                count(told("components"), "component"),
                count(told("handles"), "handle"),
                match told("boundary_edges") {
                    0 => "no boundary".to_owned(),
                    n => {
                        format!("{} of {}", count(told("boundary_loops"), "boundary loop"), count(n, "edge"))
                    }
                },
            ];
            line("topology", &topology.join(", "));
            line("found", &found(metadata));
            if !metadata.dropped.is_empty() {
                line("dropped", &metadata.dropped.join(", "));
            }
        }
        let lattice = &header.lattice;
        let step = of_diagonal(lattice.step, self.diagonal());
        line("lattice", &format!("{} bits a coordinate, step {step}", lattice.bits));
        let lifting = match header.coding.lifting {
            0 => "coarse levels are not lifted".to_owned(),
            n => format!("coarse levels are lifted by {n}/64"),
        };
        line("coding", &format!("{lifting}, {} models", models(header.coding)));
        let born: u64 = (0..header.level_count).map(|j| u64::from(self.contents.born(j)[1])).sum();
        if born > 0 {
            let what = "belong to components born at finer levels than the base; errors count what a level lacks by its size";
            line("births", &format!("{} {what}", count(born, "triangle")));
        }
        let told = |atoms| count(self.bytes_of(atoms), "byte");
        if self.is_exact() {
            let real = match self.metadata.as_ref().map(|m| m.source_float32) {
                Some(true) => " as binary32",
                Some(false) => " as binary64",
                None => "",
            };
            line(
                "exact",
                &format!("level 0 has the input's coordinates{real} ({})", told(self.contents.correction())),
            );
        }
        if !self.contents.attributes.is_empty() {
            let base = self.contents.base_level();
            let titles = self.contents.attributes.iter().map(|attribute| attribute_text(attribute, base));
            line("attributes", &titles.collect::<Vec<_>>().join(", "));
            let bytes = self.attribute_bytes();
            if bytes > 0 {
                line("", &format!("{} of them apart from base and refinements", count(bytes, "byte")));
            }
        }
        if self.resources.bytes() > 0 {
            let number = self.contents.resources.len();
            line("resources", &format!("{number} of {} together", count(self.resources.bytes(), "byte")));
        }
        if self.keeps_order() {
            line(
                "order",
                &format!("that of the input's vertices and triangles ({})", told(self.contents.order())),
            );
        }
        out
    }

    fn residue_text(&self) -> String {
        let ResidueCounts { triangles, groups, reversed_triangles, extra_vertices, .. } = self.residue;
        let parts = [
            (triangles, "triangle"),
            (groups, "stitched group"),
            (reversed_triangles, "reversed triangle"),
            (extra_vertices, "extra vertex"),
        ];
        let parts: Vec<_> = parts.iter().filter(|(n, _)| *n > 0).map(|(n, noun)| count(*n, noun)).collect();
        format!("{} ({})", parts.join(", "), count(self.bytes_of(self.contents.residue()), "byte"))
    }

    /// Keyframes but the base: level and bytes.
    fn keyframes(&self) -> impl Iterator<Item = (u32, std::ops::Range<u64>)> + '_ {
        let contents = &self.contents;
        contents.segments().filter_map(|j| Some((j, contents.bytes(contents.keyframe(j)?))))
    }

    /// What the metadata count under this name.
    fn told(&self, name: &str) -> u64 {
        self.metadata.as_ref().map_or(0, |metadata| metadata.finding(name, &self.contents.header))
    }

    /// Bytes of the atoms that have nothing but values of attributes.
    fn attribute_bytes(&self) -> u64 {
        let levels = 0..self.contents.header.level_count;
        levels.map(|j| self.bytes_of(self.contents.attribute_atoms(j))).sum()
    }

    fn bytes_of(&self, atoms: std::ops::Range<usize>) -> u64 {
        let bytes = self.contents.bytes(atoms);
        bytes.end - bytes.start
    }

    /// Coarse to fine.
    fn levels(&self) -> impl Iterator<Item = LevelLine> + '_ {
        (0..self.contents.header.level_count).rev().map(|number| {
            let bytes = self.contents.bytes(self.contents.steps(number));
            LevelLine { number, offset: bytes.start, bytes: bytes.end - bytes.start }
        })
    }
}

/// How far an attribute of a level is off, if that is told.
fn error_of(level: &Level, attribute: usize) -> Option<&AttributeError> {
    level.attributes.iter().find(|error| error.attribute == attribute)
}

/// An attribute, its numbers a value, their bits, and from which level on it is there.
fn attribute_text(attribute: &AttributeEntry, base: u32) -> String {
    let stored = attribute.stored.name();
    let numbers = match attribute.bits() {
        Some(bits) => format!("{bits} bits"),
        None => stored.to_owned(),
    };
    let there = match attribute.birth {
        _ if attribute.constant.is_some() => "constant".to_owned(),
        birth if birth >= base => "from the base on".to_owned(),
        birth => format!("from level {birth} on"),
    };
    format!("{} of {} x {numbers} {there}", attribute.title(), attribute.components)
}

/// The set of models of decisions, as the specification calls it (spec §3.2).
fn models(coding: Coding) -> &'static str {
    if coding.rich_models { "rich" } else { "plain" }
}

/// What conditioning found.
pub fn found(metadata: &Metadata) -> String {
    let found: Vec<String> = FINDINGS
        .iter()
        .filter(|(name, ..)| told(metadata, name) > 0)
        .map(|(name, noun, done)| count(told(metadata, name), noun) + done)
        .collect();
    if found.is_empty() { "a manifold".to_owned() } else { found.join(", ") }
}

/// The diagonal of the input's bounding box; that of the lattice where the metadata do not tell.
pub fn diagonal(contents: &Contents, metadata: Option<&Metadata>) -> f64 {
    let header = &contents.header;
    metadata.map_or_else(|| header.diagonal(), |metadata| metadata.diagonal_of(header))
}

/// How often what a sound mesh has not was found.
fn told(metadata: &Metadata, name: &str) -> u64 {
    metadata.conditioning.iter().find(|(n, _)| n == name).map_or(0, |&(_, n)| n)
}

struct LevelLine {
    number: u32,
    offset: u64,
    bytes: u64,
}

/// What conditioning found: its name in the metadata, in words, and what was done.
const FINDINGS: [(&str, &str, &str); 9] = [
    ("welded_vertices", "repeated vertex", " (welded)"),
    ("joined_vertices", "nearly equal vertex", " (joined)"),
    ("isolated_vertices", "isolated vertex", ""),
    ("degenerate_triangles", "degenerate triangle", ""),
    ("repeated_triangles", "repeated triangle", ""),
    ("nonmanifold_edges", "non-manifold edge", " (cut)"),
    ("nonorientable_edges", "non-orientable edge", " (cut)"),
    ("nonmanifold_vertices", "non-manifold vertex", " (cut)"),
    ("reoriented_triangles", "reversed triangle", ""),
];
