//! Words of a text file, with the lines they stand in.

use crate::MeshError;

/// What is left of a text.
pub struct Text<'b> {
    rest: &'b [u8],
    line: u64,
    /// What begins a comment, which ends with the line.
    comment: u8,
}

impl<'b> Text<'b> {
    pub fn new(bytes: &'b [u8], comment: u8) -> Self {
        // A byte order mark is no word.
        Self { rest: bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes), line: 1, comment }
    }

    /// The line of the next byte, from 1.
    pub fn line(&self) -> u64 {
        self.line
    }

    /// "line 7"
    pub fn here(&self) -> String {
        format!("line {}", self.line)
    }

    fn step(&mut self) {
        self.line += u64::from(self.rest.first() == Some(&b'\n'));
        self.rest = &self.rest[1..];
    }

    /// The next word of this line.
    pub fn word(&mut self) -> Option<&'b [u8]> {
        loop {
            match self.rest {
                [b' ' | b'\t' | b'\r' | 0x0b | 0x0c, ..] => self.step(),
                // A backslash joins the next line to this one.
                [b'\\', b'\n', ..] => (0..2).for_each(|_| self.step()),
                [b'\\', b'\r', b'\n', ..] => (0..3).for_each(|_| self.step()),
                [b'\n', ..] | [] => return None,
                [first, ..] if *first == self.comment => {
                    self.skip_to_end();
                    return None;
                }
                _ => break,
            }
        }
        let joined = |i: usize| matches!(self.rest[i..], [b'\\', b'\n' | b'\r', ..]);
        let end = (0..self.rest.len())
            .find(|&i| self.rest[i].is_ascii_whitespace() || self.rest[i] == 0x0b || joined(i))
            .unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(end);
        self.rest = rest;
        Some(word)
    }

    /// Goes to the next line; false where there is none.
    pub fn next_line(&mut self) -> bool {
        self.skip_to_end();
        let more = !self.rest.is_empty();
        if more {
            self.step();
        }
        more
    }

    fn skip_to_end(&mut self) {
        let end = self.rest.iter().position(|&b| b == b'\n').unwrap_or(self.rest.len());
        self.rest = &self.rest[end..];
    }

    /// The next word of this line or a later one.
    pub fn any_word(&mut self) -> Option<&'b [u8]> {
        loop {
            if let Some(word) = self.word() {
                return Some(word);
            }
            if !self.next_line() {
                return None;
            }
        }
    }

    /// A word as a finite number; `what` names it.
    pub fn number(&self, word: Option<&[u8]>, what: &str) -> Result<f64, MeshError> {
        let Some(word) = word else { return Err(MeshError::bad(self.here(), format!("{what} is missing"))) };
        let number = std::str::from_utf8(word).ok().and_then(|word| word.parse::<f64>().ok());
        match number {
            Some(number) if number.is_finite() => Ok(number),
            Some(number) => {
                Err(MeshError::bad(self.here(), format!("{what} is {number}, but has to be finite")))
            }
            None => {
                Err(MeshError::bad(self.here(), format!("{what} is '{}', which is no number", shown(word))))
            }
        }
    }

    /// Three coordinates.
    pub fn point(
        &mut self,
        mut word: impl FnMut(&mut Self) -> Option<&'b [u8]>,
    ) -> Result<[f64; 3], MeshError> {
        let mut point = [0.0; 3];
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            let next = word(self);
            point[axis] = self.number(next, name)?;
        }
        Ok(point)
    }

    /// A word as a whole number.
    pub fn whole(&self, word: Option<&[u8]>, what: &str) -> Result<i64, MeshError> {
        let Some(word) = word else { return Err(MeshError::bad(self.here(), format!("{what} is missing"))) };
        let whole = std::str::from_utf8(word).ok().and_then(|word| word.parse().ok());
        whole.ok_or_else(|| {
            MeshError::bad(self.here(), format!("{what} is '{}', which is no whole number", shown(word)))
        })
    }

    /// Like `whole`, but not negative.
    pub fn count(&self, word: Option<&[u8]>, what: &str) -> Result<u64, MeshError> {
        let whole = self.whole(word, what)?;
        u64::try_from(whole)
            .map_err(|_| MeshError::bad(self.here(), format!("{what} is {whole}, but has to be at least 0")))
    }
}

/// The beginning of a word, fit to be printed.
pub fn shown(word: &[u8]) -> String {
    let short = &word[..word.len().min(24)];
    let dots = if short.len() < word.len() { "..." } else { "" };
    format!("{}{dots}", String::from_utf8_lossy(short).escape_default())
}
