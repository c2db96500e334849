/* The output of the encoders of pictures. */
#ifndef FARM_MASTER_BYTE_SINK_H
#define FARM_MASTER_BYTE_SINK_H

/* Receives the next bytes of a file. Encoders do not learn of errors: the context records them. */
typedef void byte_sink(void *context, void *data, int bytes);

#endif
