//! Reader of the compact protocol of Apache Thrift, able to find the end of a value. The index at the end of a Parquet file is written in this protocol.
//!
//! Source: <https://github.com/apache/thrift/blob/master/doc/specs/thrift-compact-protocol.md>.

use std::io::Read;

use crate::table::TableError;

/// Kind of a list.
pub(super) const LIST: u8 = 9;
/// Kind of a struct.
pub(super) const STRUCT: u8 = 12;
/// Kind of an `i64` field.
pub(super) const I64: u8 = 6;
/// Header at the end of a struct's fields.
pub(super) const STOP: u8 = 0;

/// Deepest nesting of values; deeper nesting is not from a table.
const MOST_DEEP: u32 = 16;
/// Longest text \[bytes\]: the most that a manifest may have.
const LONGEST: u64 = cohaptic_files::MOST_BYTES;

/// Reads values one after the other, and keeps their bytes.
pub(super) struct Compact<R> {
    from: R,
    kept: Vec<u8>,
}

impl<R: Read> Compact<R> {
    pub(super) const fn new(from: R) -> Self {
        Self { from, kept: Vec::new() }
    }

    /// Returns the bytes read since the last call.
    pub(super) fn take(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.kept)
    }

    /// Returns the kept bytes and all further bytes.
    pub(super) fn rest(mut self) -> Result<Vec<u8>, TableError> {
        self.from.read_to_end(&mut self.kept)?;
        Ok(self.kept)
    }

    /// Reads the header of a struct's next field: number and kind; `None` at the end of the struct. `last`: number of the field before, 0 for the first field.
    pub(super) fn field(&mut self, last: i64) -> Result<Option<(i64, u8)>, TableError> {
        let header = self.byte()?;
        if header == STOP {
            return Ok(None);
        }
        let (step, kind) = (header >> 4, header & 15);
        // The header holds the distance to the last number. A distance of 0 announces a full number.
        let number = if step == 0 { self.integer()? } else { last + i64::from(step) };
        Ok(Some((number, kind)))
    }

    /// Reads the header of a list: number and kind of the elements.
    pub(super) fn list(&mut self) -> Result<(u64, u8), TableError> {
        let header = self.byte()?;
        let count = match header >> 4 {
            // Lists of 15 or more elements have their length in a separate number.
            15 => self.varint()?,
            few => u64::from(few),
        };
        Ok((count, header & 15))
    }

    /// Reads an integer of two, four or eight bytes.
    pub(super) fn integer(&mut self) -> Result<i64, TableError> {
        let zigzag = self.varint()?;
        // Zigzag: 0, −1, 1, −2, … are written as 0, 1, 2, 3, …
        Ok((zigzag >> 1).cast_signed() ^ -(zigzag & 1).cast_signed())
    }

    /// Skips the value of a field of this kind.
    pub(super) fn skip(&mut self, kind: u8) -> Result<(), TableError> {
        self.skip_at(kind, 0)
    }

    fn skip_at(&mut self, kind: u8, depth: u32) -> Result<(), TableError> {
        // A damaged file could nest without end, and the recursion would overflow the stack.
        if depth > MOST_DEEP {
            return Err(no_metadata());
        }
        match kind {
            // The kind of a Boolean field is its value.
            1 | 2 => Ok(()),
            3 => self.byte().map(drop),
            4..=6 => self.varint().map(drop),
            7 => self.bytes(8),
            8 => {
                let length = self.varint()?;
                self.bytes(length)
            }
            LIST | 10 => {
                let (count, kind) = self.list()?;
                // Boolean elements of a list have one byte each, unlike Boolean fields.
                let kind = if kind <= 2 { 3 } else { kind };
                (0..count).try_for_each(|_| self.skip_at(kind, depth + 1))
            }
            STRUCT => {
                let mut last = 0;
                while let Some((number, kind)) = self.field(last)? {
                    self.skip_at(kind, depth + 1)?;
                    last = number;
                }
                Ok(())
            }
            // The metadata of Parquet have no maps.
            _ => Err(no_metadata()),
        }
    }

    fn byte(&mut self) -> Result<u8, TableError> {
        let mut byte = [0];
        self.from.read_exact(&mut byte)?;
        self.kept.push(byte[0]);
        Ok(byte[0])
    }

    fn bytes(&mut self, count: u64) -> Result<(), TableError> {
        // A damaged length must not make the reader collect the rest of the file.
        if count > LONGEST {
            return Err(no_metadata());
        }
        // `read_to_end` grows with the bytes present: a damaged length reserves no memory.
        let read = (&mut self.from).take(count).read_to_end(&mut self.kept)?;
        if read as u64 == count { Ok(()) } else { Err(no_metadata()) }
    }

    fn varint(&mut self) -> Result<u64, TableError> {
        let mut value = 0;
        // Ten bytes hold 64 bits. A longer number is a fault.
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            value |= u64::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return Ok(value);
            }
        }
        Err(no_metadata())
    }
}

/// Appends a number in groups of seven bits, the lowest group first. The top bit of a byte announces a further byte.
pub(super) fn put_varint(bytes: &mut Vec<u8>, mut value: u64) {
    while value >= 0x80 {
        bytes.push(value.to_le_bytes()[0] | 0x80);
        value >>= 7;
    }
    bytes.push(value.to_le_bytes()[0]);
}

/// Appends the header of a list.
pub(super) fn put_list(bytes: &mut Vec<u8>, count: u64, kind: u8) {
    match u8::try_from(count) {
        Ok(few) if few < 15 => bytes.push(few << 4 | kind),
        _ => {
            bytes.push(15 << 4 | kind);
            put_varint(bytes, count);
        }
    }
}

pub(super) fn no_metadata() -> TableError {
    TableError::Content("its end says nothing of a table".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_lists_read_back() {
        for value in [0, 1, 127, 128, 300, 16_383, 16_384, u64::from(u32::MAX), u64::MAX] {
            let mut bytes = Vec::new();
            put_varint(&mut bytes, value);
            put_list(&mut bytes, value, STRUCT);
            let mut from = Compact::new(bytes.as_slice());
            assert_eq!((from.varint().unwrap(), from.list().unwrap()), (value, (value, STRUCT)));
            assert_eq!(from.take(), bytes);
        }
    }

    /// Examples of each kind, from the page of the protocol.
    #[test]
    fn a_struct_is_left_at_its_end() {
        let one_of_each: [&[u8]; 11] = [
            &[0x11],                                                        // 1: true
            &[0x13, 0x80],                                                  // 2: a byte
            &[0x15, 0xac, 0x02],                                            // 3: an integer of two bytes
            &[0x17, 0, 0, 0, 0, 0, 0, 0xf0, 0x3f],                          // 4: 1.0
            &[0x18, 3, b'a', b'b', 0],                                      // 5: a text with what would end a struct
            &[0x19, 0x21, 1, 2],                                            // 6: two truths
            &[0x19, 0x25, 0, 1],                                            // 7: two integers
            &[0x1a, 0xf8, 15, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0], // 8: fifteen empty texts, as a set
            &[0x1c, 0x16, 1, 0],                                            // 9: a struct
            &[0x0c, 0xd0, 0x0f, 0],                                         // 1000: an empty struct, its number in full
            &[0],
        ];
        let mut bytes = one_of_each.concat();
        let length = bytes.len();
        bytes.extend([0x16, 1]);
        let mut from = Compact::new(bytes.as_slice());
        from.skip(STRUCT).unwrap();
        assert_eq!(from.take().len(), length);
        assert_eq!((from.field(0).unwrap(), from.integer().unwrap()), (Some((1, I64)), -1));
    }

    #[test]
    fn what_has_no_end_is_refused() {
        let deep = [0x1c; 1000];
        let long = [0x18, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x01];
        let endless = [0x16, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff];
        let map = [0x1b, 0];
        for bytes in [deep.as_slice(), &long, &endless, &map, &[0x18, 4, 1, 2]] {
            assert!(matches!(Compact::new(bytes).skip(STRUCT), Err(TableError::Content(_))), "{bytes:?}");
        }
        assert!(matches!(Compact::new([0x16].as_slice()).skip(STRUCT), Err(TableError::Io(_))));
    }
}
