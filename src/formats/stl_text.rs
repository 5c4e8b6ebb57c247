//! The text of STL.

use crate::error::Result;
use crate::mesh::IndexedMesh;
use crate::mesh::attributes::Semantic;

use super::Source;
use super::fan::{Faces, Fans};
use super::gather::{self, Gathered};
use super::origins::Origins;
use super::stl::{Normals, begins, not_finite, source, text_words};
use super::text::{ENDS_EARLY, Words, number, quoted};

/// A text file as it is read.
pub(super) struct Text<'a> {
    words: Words<'a>,
    positions: Vec<[f64; 3]>,
    fans: Fans,
    facets: usize,
    open: Option<Solid<'a>>,
    /// Solids that had facets, and the first facet and the name of each.
    solids: Parts<'a>,
    normals: Normals,
}

impl<'a> Text<'a> {
    pub(super) fn new(bytes: &'a [u8], name: &'a str) -> Self {
        let words = text_words(bytes, name);
        let (positions, fans, normals) = (Vec::new(), Fans::default(), Normals::default());
        Self { words, positions, fans, facets: 0, open: None, solids: Parts::default(), normals }
    }

    pub(super) fn read(mut self, force: bool) -> Result<Source> {
        let mut ahead = self.words.clone();
        if !begins(&mut ahead) {
            return Err(ahead.fault("not an STL file: text that does not begin with `solid`"));
        }
        while let Some(word) = self.word() {
            match self.is(word, &["facet", "endsolid", "solid"])? {
                0 => self.facet()?,
                1 => {
                    self.close();
                    self.words.skip_line();
                }
                _ => {
                    self.close();
                    let name = self.words.rest_of_line();
                    self.open = Some(Solid { facets: self.facets, name });
                }
            }
        }
        if self.open.is_some() && !force {
            return Err(self.words.fault(format!("{ENDS_EARLY}: there is no `endsolid`")));
        }
        self.close();
        let Faces { mesh, polygons, notes, origins } = self.fans.mesh(self.positions);
        let mut gathered = Gathered::default();
        let part_names = self.solids.finish(&origins, &mut gathered);
        let mesh = IndexedMesh { part_names, ..gathered.mesh(mesh) };
        let dropped = gathered.dropped.into_iter().chain(self.normals.in_words()).chain(notes).collect();
        Ok(source(mesh, polygons, true, dropped))
    }

    /// The present solid, if there is one, has ended.
    fn close(&mut self) {
        if let Some(solid) = self.open.take().filter(|solid| solid.facets < self.facets) {
            self.solids.push(solid.facets as u32, solid.name);
        }
    }

    /// Reads a facet behind its first word.
    #[inline]
    fn facet(&mut self) -> Result<()> {
        self.one_of(&["normal"])?;
        let mut normal = [f64::NAN; 3];
        for x in &mut normal {
            // Many a file has no number here.
            *x = number(self.next()?).unwrap_or(f64::NAN);
        }
        self.one_of(&["outer"])?;
        self.one_of(&["loop"])?;
        let first = self.positions.len();
        while self.one_of(&["vertex", "endloop"])? == 0 {
            let mut position = [0.0; 3];
            for (axis, x) in position.iter_mut().enumerate() {
                *x = self.words.number()?;
                if !x.is_finite() {
                    let corner = self.positions.len() - first;
                    return Err(self.words.fault(not_finite(axis, corner, self.facets, *x)));
                }
            }
            // Beyond 32 bits it is beyond the limit of a mesh too.
            self.fans.corner(self.positions.len() as u32);
            self.positions.push(position);
        }
        if let [a, b, c, ..] = self.positions[first..] {
            self.normals.look_at(normal, [a, b, c]);
        }
        self.fans.end();
        self.facets += 1;
        self.one_of(&["endfacet"]).map(drop)
    }

    /// Reads a word, which must be one of some keywords, and returns which.
    #[inline]
    fn one_of(&mut self, keywords: &[&str]) -> Result<usize> {
        let word = self.next()?;
        self.is(word, keywords)
    }

    #[inline]
    fn is(&self, word: &[u8], keywords: &[&str]) -> Result<usize> {
        let found = keywords.iter().position(|keyword| {
            // `endsolid1` is met with.
            let word = if *keyword == "endsolid" { &word[..word.len().min(8)] } else { word };
            word.eq_ignore_ascii_case(keyword.as_bytes())
        });
        found.ok_or_else(|| {
            let keywords = keywords.iter().map(|keyword| format!("`{keyword}`")).collect::<Vec<_>>();
            self.words.fault(format!("{} where {} should be", quoted(word), keywords.join(" or ")))
        })
    }

    #[inline]
    fn next(&mut self) -> Result<&'a [u8]> {
        self.word().ok_or_else(|| self.words.fault(ENDS_EARLY))
    }

    /// The next word; `end loop` is one.
    #[inline]
    fn word(&mut self) -> Option<&'a [u8]> {
        let word = self.words.word()?;
        if !word.eq_ignore_ascii_case(b"end") {
            return Some(word);
        }
        let mut ahead = self.words.clone();
        let what = ahead.word_in_line().unwrap_or_default();
        let Some((_, whole)) = ENDS.iter().find(|(second, _)| what.eq_ignore_ascii_case(second)) else {
            return Some(word);
        };
        self.words = ahead;
        Some(whole)
    }
}

/// A solid that began.
struct Solid<'a> {
    /// Facets before it.
    facets: usize,
    name: &'a [u8],
}

/// The solids of a file, which are its parts.
#[derive(Default)]
struct Parts<'a> {
    runs: Vec<(u32, u32)>,
    names: Vec<&'a [u8]>,
}

impl<'a> Parts<'a> {
    fn push(&mut self, facet: u32, name: &'a [u8]) {
        self.runs.push((facet, self.names.len() as u32));
        self.names.push(name);
    }

    /// The names, where there are any or several solids; they are those of objects.
    fn finish(self, origins: &Origins, gathered: &mut Gathered) -> Vec<String> {
        if self.names.len() < 2 && self.names.iter().all(|name| name.is_empty()) {
            return Vec::new();
        }
        gathered.take(gather::numbers(Semantic::Part, origins.of_runs(&self.runs)), "solids");
        let name = |name: &&[u8]| match String::from_utf8_lossy(name) {
            name if name.is_empty() => String::new(),
            name => format!("o {name}"),
        };
        self.names.iter().map(name).collect()
    }
}

/// Second words of two that are read as one.
const ENDS: [(&[u8], &[u8]); 3] = [(b"loop", b"endloop"), (b"facet", b"endfacet"), (b"solid", b"endsolid")];
