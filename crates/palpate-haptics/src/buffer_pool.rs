//! Single-producer single-consumer (SPSC) buffer pool: two ring buffers between which preallocated buffers circulate.
//!
//! ```text
//! producer → filled → consumer
//! producer ← empty  ← consumer
//! ```
//!
//! Neither end waits, locks or allocates. A producer that finds no empty buffer drops the record and counts it.

/// Producing end of a buffer pool.
pub struct PoolProducer<T> {
    filled: rtrb::Producer<Box<T>>,
    empty: rtrb::Consumer<Box<T>>,
    missed: u64,
}

/// Consuming end of a buffer pool.
pub struct PoolConsumer<T> {
    filled: rtrb::Consumer<Box<T>>,
    empty: rtrb::Producer<Box<T>>,
}

/// Buffer pool with `capacity` buffers, each from one call of `make`: a clone would not keep the capacity of its vectors.
pub fn buffer_pool<T>(capacity: usize, make: impl Fn() -> T) -> (PoolProducer<T>, PoolConsumer<T>) {
    let (filled_in, filled_out) = rtrb::RingBuffer::new(capacity);
    let (mut empty_in, empty_out) = rtrb::RingBuffer::new(capacity);
    while empty_in.push(Box::new(make())).is_ok() {}
    (
        PoolProducer { filled: filled_in, empty: empty_out, missed: 0 },
        PoolConsumer { filled: filled_out, empty: empty_in },
    )
}

impl<T> PoolProducer<T> {
    /// Fills an empty buffer and passes it on; without one, counts a miss.
    ///
    /// # Real time
    /// No allocation, lock or system call.
    pub fn produce(&mut self, fill: impl FnOnce(&mut T)) {
        let Ok(mut buffer) = self.empty.pop() else {
            self.missed += 1;
            return;
        };
        fill(&mut buffer);
        // Never full: there are as many slots as buffers.
        self.missed += u64::from(self.filled.push(buffer).is_err());
    }

    /// Number of records for which there was no empty buffer.
    pub fn missed(&self) -> u64 {
        self.missed
    }
}

impl<T> PoolConsumer<T> {
    /// Passes every filled buffer to `take`, in order, and recycles it. Ends at the first error.
    pub fn consume<E>(&mut self, mut take: impl FnMut(&T) -> Result<(), E>) -> Result<(), E> {
        while let Ok(buffer) = self.filled.pop() {
            take(&buffer)?;
            // Never full: there are as many slots as buffers.
            let _ = self.empty.push(buffer);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_arrive_in_order_and_those_without_a_buffer_are_counted() {
        let (mut producer, mut consumer) = buffer_pool(3, || 0_u32);
        let mut received = Vec::new();
        for round in 0..4_u32 {
            // One more than there are buffers.
            (0..4).for_each(|at| producer.produce(|buffer| *buffer = 10 * round + at));
            let done: Result<(), ()> = consumer.consume(|number| {
                received.push(*number);
                Ok(())
            });
            assert_eq!(done, Ok(()));
        }
        assert_eq!(received, [0, 1, 2, 10, 11, 12, 20, 21, 22, 30, 31, 32]);
        assert_eq!(producer.missed(), 4);
    }
}
