"""Messages of one component: streams, inputs, outputs, status, and the buffers that keep them."""
