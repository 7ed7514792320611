//! The device's own clock, read around a submission.

use super::context::{Attempt, Context};

/// Bytes of two time stamps.
const SIZE: u64 = 16;

/// Two time stamps and their way to the host.
pub(super) struct Clock {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    readback: wgpu::Buffer,
}

impl Clock {
    /// A clock on a device that has timestamp queries.
    pub(super) fn new(context: &Context) -> Self {
        use wgpu::BufferUsages as Usage;
        Self {
            queries: context.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("clock"),
                ty: wgpu::QueryType::Timestamp,
                count: 2,
            }),
            resolved: context.buffer("ticks", SIZE, Usage::QUERY_RESOLVE | Usage::COPY_SRC),
            readback: context.buffer("ticks", SIZE, Usage::MAP_READ | Usage::COPY_DST),
        }
    }

    /// Has a pass note when it begins and ends.
    pub(super) fn writes(&self) -> wgpu::ComputePassTimestampWrites<'_> {
        wgpu::ComputePassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(0),
            end_of_pass_write_index: Some(1),
        }
    }

    /// Copies what the pass has noted to where the host can read it.
    pub(super) fn resolve(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.resolve_query_set(&self.queries, 0..2, &self.resolved, 0);
        encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.readback, 0, SIZE);
    }

    /// Asks for the ticks once the pass is submitted.
    pub(super) fn ask(&self) {
        // Whether that failed shows when they are read.
        self.readback.map_async(wgpu::MapMode::Read, .., |_| {});
    }

    /// Ticks between the pass's begin and end, once its submission is done.
    ///
    /// # Errors
    /// If the device is gone.
    pub(super) fn ticks(&self, context: &Context) -> Attempt<u64> {
        let view = context.mapped(&self.readback, SIZE)?;
        let &[begin, end] = bytemuck::from_bytes::<[u64; 2]>(&view);
        drop(view);
        self.readback.unmap();
        Ok(end.saturating_sub(begin))
    }
}
