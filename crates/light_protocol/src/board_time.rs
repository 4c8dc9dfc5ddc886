/// A time on the firmware's clock: microseconds since its reset, wrapping after 71.6 minutes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct BoardTime(pub u32);

impl BoardTime {
    /// Microseconds from `earlier` to this time; right across a wrap if they are less than 71.6 minutes apart.
    pub const fn micros_since(self, earlier: Self) -> u32 {
        self.0.wrapping_sub(earlier.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_right_across_the_wrap() {
        assert_eq!(BoardTime(500).micros_since(BoardTime(u32::MAX - 499)), 1000);
    }
}
