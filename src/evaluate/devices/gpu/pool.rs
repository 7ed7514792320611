//! Buffers that are used again, from generation to generation.

use super::context::Context;

/// Buffers of one usage. There are never more than have been in use at once.
pub(super) struct Pool {
    label: &'static str,
    usage: wgpu::BufferUsages,
    free: Vec<wgpu::Buffer>,
}

impl Pool {
    pub(super) fn new(label: &'static str, usage: wgpu::BufferUsages) -> Self {
        Self {
            label,
            usage,
            free: Vec::new(),
        }
    }

    /// A buffer of `size` bytes or more, with anything in it.
    pub(super) fn take(&mut self, context: &Context, size: u64) -> wgpu::Buffer {
        self.free.sort_by_key(wgpu::Buffer::size);
        let fits = self.free.partition_point(|buffer| buffer.size() < size);
        if fits < self.free.len() {
            return self.free.remove(fits);
        }
        // The largest that is too small grows.
        self.free.pop();
        context.buffer(self.label, size.next_multiple_of(256), self.usage)
    }

    /// Takes back a buffer that nothing but submitted work uses.
    pub(super) fn give(&mut self, buffer: wgpu::Buffer) {
        self.free.push(buffer);
    }
}
