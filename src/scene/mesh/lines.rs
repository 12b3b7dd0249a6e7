//! Lines of text files, counted from 1, with all common line ends and byte order marks.

use std::io::{self, BufRead};

use super::Problem;

/// The remedy for a truncated file.
pub const DAMAGED: &str = "the file is damaged or cut short: save or fetch it again";

/// The lines of a text: `\n`, `\r\n` and `\r` end them, and a leading byte order mark is skipped.
pub struct Lines<R> {
    source: R,
    line: Vec<u8>,
    /// Number of the line returned last, from 1.
    number: usize,
    /// The last line ended in `\r`: a following `\n` belongs to that end.
    after_return: bool,
    /// Whether any line ended in `\r\n`.
    pairs: bool,
}

impl<R: BufRead> Lines<R> {
    /// # Errors
    /// If the text is UTF-16, or cannot be read at all.
    pub fn new(mut source: R) -> Result<Self, Problem> {
        let start = source.fill_buf().map_err(unreadable)?;
        let pair = |zero: usize| start.len() >= 4 && start[zero] == 0 && start[zero + 2] == 0 && start[1 - zero] != 0;
        if start.starts_with(&[0xff, 0xfe]) || start.starts_with(&[0xfe, 0xff]) || pair(0) || pair(1) {
            return Err(Problem::new("is a text in UTF-16", "save it as UTF-8 or plain ASCII"));
        }
        if start.starts_with(&[0xef, 0xbb, 0xbf]) {
            source.consume(3);
        }
        Ok(Self {
            source,
            line: Vec::new(),
            number: 0,
            after_return: false,
            pairs: false,
        })
    }

    /// The next line without its end, and its number; `None` after the last one.
    pub fn next(&mut self) -> Result<Option<(usize, &[u8])>, Problem> {
        self.line.clear();
        Ok(self.append()?.then_some((self.number, &self.line)))
    }

    /// Appends the next line to `line`; `false` after the last one.
    fn append(&mut self) -> Result<bool, Problem> {
        let mut any = false;
        loop {
            let bytes = self.source.fill_buf().map_err(unreadable)?;
            if bytes.is_empty() {
                self.number += usize::from(any);
                return Ok(any);
            }
            if std::mem::take(&mut self.after_return) && bytes[0] == b'\n' {
                self.pairs = true;
                self.source.consume(1);
                continue;
            }
            any = true;
            let Some(end) = bytes.iter().position(|&byte| byte == b'\n' || byte == b'\r') else {
                self.line.extend_from_slice(bytes);
                let all = bytes.len();
                self.source.consume(all);
                continue;
            };
            self.line.extend_from_slice(&bytes[..end]);
            self.after_return = bytes[end] == b'\r';
            self.source.consume(end + 1);
            self.number += 1;
            return Ok(true);
        }
    }

    /// Like [`next`](Self::next), but joins lines continued by a `\` at the end; returns the number of the first.
    pub fn next_continued(&mut self) -> Result<Option<(usize, &[u8])>, Problem> {
        self.line.clear();
        if !self.append()? {
            return Ok(None);
        }
        let first = self.number;
        while self.line.last() == Some(&b'\\') {
            self.line.pop();
            self.line.push(b' ');
            if !self.append()? {
                break;
            }
        }
        Ok(Some((first, &self.line)))
    }

    pub fn number(&self) -> usize {
        self.number
    }

    /// The rest of the source after the line returned last, exact to the byte.
    pub fn into_rest(mut self) -> Result<R, Problem> {
        // If lines only end in `\r`, a `\n` is the first byte of the rest.
        if self.after_return && self.pairs && self.source.fill_buf().map_err(unreadable)?.first() == Some(&b'\n') {
            self.source.consume(1);
        }
        Ok(self.source)
    }
}

/// The words of a line.
pub fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    // A vertical tab counts as a space.
    let parts = line.split(|byte| byte.is_ascii_whitespace() || *byte == 0x0b);
    parts.filter(|word| !word.is_empty())
}

/// Parses a word as a number.
pub fn number<T: std::str::FromStr>(word: &[u8]) -> Option<T> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// Parses the next `N` words as numbers.
pub fn numbers<'w, const N: usize>(words: &mut impl Iterator<Item = &'w [u8]>) -> Option<[f64; N]> {
    let mut all = [0.0; N];
    for place in &mut all {
        *place = number(words.next()?)?;
    }
    Some(all)
}

/// The problem of a read error.
pub fn unreadable(error: io::Error) -> Problem {
    match error.kind() {
        io::ErrorKind::UnexpectedEof => Problem::new("is cut short: its compressed data has no end", DAMAGED),
        io::ErrorKind::OutOfMemory => {
            Problem::new("unpacks to more than the memory that is free", "use a smaller mesh")
        }
        _ => Problem::new(format!("cannot be read: {error}"), DAMAGED),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(text: &[u8]) -> Vec<(usize, String)> {
        // A tiny buffer, so that line ends and marks span two reads.
        let mut lines = Lines::new(io::BufReader::with_capacity(4, text)).unwrap();
        let mut all = Vec::new();
        while let Some((number, line)) = lines.next().unwrap() {
            all.push((number, String::from_utf8_lossy(line).into_owned()));
        }
        all
    }

    #[test]
    fn every_line_end_counts_the_same() {
        let expected: Vec<_> = ["one", "", "three and more", "last"]
            .map(str::to_owned)
            .into_iter()
            .collect();
        let expected: Vec<_> = (1..).zip(expected).collect();
        for end in ["\n", "\r\n", "\r"] {
            for (mark, last) in [("", ""), ("\u{feff}", end)] {
                let text = format!("{mark}one{end}{end}three and more{end}last{last}");
                assert_eq!(lines(text.as_bytes()), expected, "{end:?}");
            }
        }
    }

    #[test]
    fn a_backslash_continues_a_line() {
        let mut lines = Lines::new(&b"f 1 \\\r\n2 3\\\r\n 4\r\ng\\"[..]).unwrap();
        assert_eq!(lines.next_continued().unwrap().unwrap(), (1, &b"f 1  2 3  4"[..]));
        assert_eq!(lines.next_continued().unwrap().unwrap(), (4, &b"g "[..]));
        assert!(lines.next_continued().unwrap().is_none());
    }

    #[test]
    fn what_follows_a_line_is_exact() {
        for (text, rest) in [
            ("a\r\nb\r\n\ncd", "\ncd"),
            ("a\rb\r\ncd", "\ncd"),
            ("a\nb\n\ncd", "\ncd"),
        ] {
            let mut lines = Lines::new(text.as_bytes()).unwrap();
            lines.next().unwrap();
            assert_eq!(lines.next().unwrap().unwrap(), (2, &b"b"[..]));
            assert_eq!(lines.into_rest().unwrap(), rest.as_bytes(), "{text:?}");
        }
    }

    #[test]
    fn utf_16_is_said_to_be_so() {
        let wide = |text: &str, big: bool, mark: bool| -> Vec<u8> {
            let mark = mark.then_some(0xfeff);
            let units = mark.into_iter().chain(text.encode_utf16());
            units
                .flat_map(|unit| if big { unit.to_be_bytes() } else { unit.to_le_bytes() })
                .collect()
        };
        for (big, mark) in [(true, true), (true, false), (false, true), (false, false)] {
            let error = Lines::new(&wide("v 0 0 0\n", big, mark)[..]).err().unwrap();
            assert_eq!(error.what, "is a text in UTF-16");
        }
    }
}
