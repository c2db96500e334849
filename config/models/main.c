/* models DIR: writes every generated model of the sample scenes into the folder DIR. */
#include <stdio.h>

#include "config/models/models.h"

int main(int argc, char **argv)
{
    if (argc != 2) {
        fprintf(stderr, "usage: models DIR\n");
        return 2;
    }
    return write_lantern(argv[1]) && write_garden(argv[1]) ? 0 : 1;
}
