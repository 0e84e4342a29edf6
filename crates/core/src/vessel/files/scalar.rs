//! Numbers of binary files.

/// A numeric type.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

/// Byte order of numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Order {
    Little,
    Big,
}

impl Scalar {
    /// Size in bytes.
    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// The number in the first bytes of `bytes`, or `None` if they are too few. Whole numbers beyond 2⁵³ are rounded.
    pub(super) fn read(self, bytes: &[u8], order: Order) -> Option<f64> {
        /// The bytes of one number, lowest first.
        fn lowest_first<const N: usize>(bytes: &[u8], order: Order) -> Option<[u8; N]> {
            let mut own = *bytes.first_chunk::<N>()?;
            if order == Order::Big {
                own.reverse();
            }
            Some(own)
        }
        Some(match self {
            Self::I8 => i8::from_le_bytes(lowest_first(bytes, order)?).into(),
            Self::U8 => u8::from_le_bytes(lowest_first(bytes, order)?).into(),
            Self::I16 => i16::from_le_bytes(lowest_first(bytes, order)?).into(),
            Self::U16 => u16::from_le_bytes(lowest_first(bytes, order)?).into(),
            Self::I32 => i32::from_le_bytes(lowest_first(bytes, order)?).into(),
            Self::U32 => u32::from_le_bytes(lowest_first(bytes, order)?).into(),
            Self::I64 => i64::from_le_bytes(lowest_first(bytes, order)?) as f64,
            Self::U64 => u64::from_le_bytes(lowest_first(bytes, order)?) as f64,
            Self::F32 => f32::from_le_bytes(lowest_first(bytes, order)?).into(),
            Self::F64 => f64::from_le_bytes(lowest_first(bytes, order)?),
        })
    }
}

/// A number as a vertex index; one that is not a whole number becomes an invalid index.
pub(super) fn index(number: f64) -> i64 {
    if number.fract() == 0.0 { number as i64 } else { i64::MIN }
}
