/*
 * How MPI is to carry messages, where it can be told.
 */
#ifndef FARM_COMMON_TRANSPORT_H
#define FARM_COMMON_TRANSPORT_H

/*
 * Before MPI starts: what most results are goes eagerly, copied by the sender. UCX, over which MPICH runs,
 * would let the receiver fetch a message of more than 8 KB between two processes of a machine, with system
 * calls: of a pixel in a tile of 32 x 32 that took the master 3.5 ns instead of 0.9 ns. Long messages are
 * fetched still, as many small pieces of them would take as long, and would wait in rank 0's memory. Who
 * sets UCX_RNDV_THRESH himself has his way; another transport knows nothing of it.
 */
void transport_prefer_eager(void);

#endif
