//! Numbers for things that come and go.

/// Puts a thing into the first free slot and gives back its number, which it keeps until the slot is emptied.
pub(crate) fn put<T>(slots: &mut Vec<Option<T>>, thing: T) -> usize {
    let free = slots.iter().position(Option::is_none).unwrap_or(slots.len());
    if free == slots.len() {
        slots.push(None);
    }
    slots[free] = Some(thing);
    free
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn free_slots_are_filled_first() {
        let mut slots = vec![Some('a'), None, Some('c'), None];
        assert_eq!([put(&mut slots, 'b'), put(&mut slots, 'd'), put(&mut slots, 'e')], [1, 3, 4]);
        assert_eq!(slots.into_iter().flatten().collect::<String>(), "abcde");
    }
}
