# The scenes that sections can be asked for.

# The camera and the material of what adaptive sampling is to find.
facing() {
    cat <<'END'
[camera]
eye = 0 0 6
look_at = 0 0 0
fov = 30
[background]
color = 0.1 0.1 0.1
[material bright]
color = 1 0.3 0.5
ambient = 1
diffuse = 0
END
}

# specks COUNT THICKNESS: a scene of COUNT objects at random places, half of them balls and half needles, which adaptive
# sampling hits only by chance. With THICKNESS 1, at 200 x 150, balls are a third of a pixel wide and needles a twelfth.
specks() {
    facing
    awk -v count="$1" -v thick="$2" 'function part(x) { return x - int(x) }
        BEGIN { for (i = 1; i <= count; i++) {
            x = 4.2 * (part(i * 0.7548776662466927) - 0.5); y = 3.15 * (part(i * 0.5698402909980532) - 0.5)
            turn = 6.28 * part(i * 0.618033988749895); u = 0.05 * cos(turn); v = 0.05 * sin(turn)
            if (i % 2) printf "[sphere %d]\ncenter = %.9f %.9f 0\nradius = %g\nmaterial = bright\n", i, x, y, 0.0034 * thick
            else printf "[cylinder %d]\nbase = %.9f %.9f 0\napex = %.9f %.9f 0\nradius = %g\nmaterial = bright\n",
                i, x - u, y - v, x + u, y + v, 0.00086 * thick
        } }'
}

# Bars half a pixel wide, one in each column of pixels, and a ball: a pattern that all pixels have, at the present size.
bars() {
    facing
    awk -v height="$H" 'BEGIN { pixel = 2 * 6 * 0.26794919243112 / height # tan(15 degrees), half of the field of view
        for (i = -height; i < height; i++)
            printf "[box %d]\nmin = %.9f -2 -0.01\nmax = %.9f 2 0\nmaterial = bright\n", i, i * pixel, (i + 0.5) * pixel }'
    printf '[material dark]\ncolor = 0.2 0.3 0.6\nambient = 1\ndiffuse = 0\n'
    printf '[sphere]\ncenter = 0.7 0.4 0.5\nradius = 0.5\nmaterial = dark\n'
}

config_of() {
    for ending in ini nff obj; do
        [ -n "$FOLDER" ] && [ -e "$FOLDER/$1.$ending" ] && echo "$FOLDER/$1.$ending" && return
    done
    case $1 in
    lantern | garden) echo "config/$1.ini" ;;
    specks) [ -e "$WORK/specks.ini" ] || specks 1200 1 >"$WORK/specks.ini"; echo "$WORK/specks.ini" ;;
    dust) [ -e "$WORK/dust.ini" ] || specks 300 0.5 >"$WORK/dust.ini"; echo "$WORK/dust.ini" ;; # few are met
    bars) bars >"$WORK/bars.ini"; echo "$WORK/bars.ini" ;;
    balls) [ -e "$WORK/balls.ini" ] || "$TOOL" scene "$WORK" balls; echo "$WORK/balls.ini" ;;
    *) echo "config/extreme/$1.ini" ;;
    esac
}
