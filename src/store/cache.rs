//! Parts of files that are often wanted, in memory: a part that many read at a time is copied from the system once.

use std::sync::{Arc, Mutex, PoisonError};

use bytes::Bytes;
use lru::LruCache;

/// Which part: of which version of which file, and the how manieth.
pub type Key = (Arc<str>, u64);

/// The parts that were wanted last.
#[derive(Debug)]
pub struct Cache {
    known: Mutex<Known>,
    most: usize,
}

#[derive(Debug)]
struct Known {
    parts: LruCache<Key, Bytes>,
    bytes: usize,
}

impl Cache {
    /// One that holds at most so many bytes, with what it takes to find them.
    pub fn new(most: usize) -> Self {
        Self { known: Mutex::new(Known { parts: LruCache::unbounded(), bytes: 0 }), most }
    }

    /// A part, if it is here.
    pub fn get(&self, key: &Key) -> Option<Bytes> {
        self.known().parts.get(key).cloned()
    }

    /// Keeps a part, and drops those that nobody has wanted for the longest time, as long as there are too many.
    pub fn put(&self, key: Key, part: Bytes) {
        let mut guard = self.known();
        let known = &mut *guard;
        known.bytes += size(&key, &part);
        let old = known.parts.push(key, part);
        known.bytes -= old.map_or(0, |(key, part)| size(&key, &part));
        while known.bytes > self.most {
            let Some((key, part)) = known.parts.pop_lru() else { break };
            known.bytes -= size(&key, &part);
        }
    }

    fn known(&self) -> std::sync::MutexGuard<'_, Known> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn size((name, _): &Key, part: &Bytes) -> usize {
    OVERHEAD + name.len() + part.len()
}

/// What the list takes for each part, about.
const OVERHEAD: usize = 128;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_kept_is_bounded() {
        let cache = Cache::new(10_000);
        let name: Arc<str> = "a".into();
        let part = |number: u64| Bytes::from(vec![number as u8; 871]);
        for number in 0..30 {
            cache.put((name.clone(), number), part(number));
            assert!(cache.get(&(name.clone(), 0)).is_some(), "wanted again and again");
        }
        // Each takes 871 + 128 + 1 bytes.
        let kept: Vec<u64> = (0..30).filter(|&number| cache.get(&(name.clone(), number)).is_some()).collect();
        assert_eq!(kept, [0, 21, 22, 23, 24, 25, 26, 27, 28, 29]);
        assert_eq!(cache.get(&(name.clone(), 25)), Some(part(25)));
        cache.put((name.clone(), 25), part(1));
        assert_eq!((cache.get(&(name.clone(), 25)), cache.known().bytes), (Some(part(1)), 10_000));
        cache.put((name.clone(), 99), vec![0; 20_000].into());
        assert_eq!(cache.known().bytes, 0, "what is too large takes the place of all, and goes");
    }
}
