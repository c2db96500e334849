/* Where encoders put what they have worked out. */
#ifndef FARM_MASTER_BYTE_SINK_H
#define FARM_MASTER_BYTE_SINK_H

/* Takes the next bytes of a file; remembers its own errors. */
typedef void byte_sink(void *context, void *data, int bytes);

#endif
