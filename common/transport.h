/*
 * How MPI is to carry messages, where it can be told.
 */
#ifndef FARM_COMMON_TRANSPORT_H
#define FARM_COMMON_TRANSPORT_H

/*
 * Before MPI starts: results are sent eagerly. UCX, over which MPICH runs, lets the receiver fetch a
 * message of more than 8 KB between two processes of a machine, with system calls: of a pixel in a tile of
 * 32 x 32 that took the master 3.5 ns instead of 0.9 ns. What is longer than any result (the scene on its
 * way to another machine) is fetched still. Who sets UCX_RNDV_THRESH himself has his way; another
 * transport knows nothing of it.
 */
void transport_prefer_eager(void);

#endif
