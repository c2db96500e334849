# The structure of the sources: which files may include or use which.
. test/lib.sh

none() { # PATTERN FILES...: no line matches, and all of them can be read
    grep -nE "$@"
    [ $? -eq 1 ]
}
check "MPI is called where the farm sends and receives alone" none '\bMPI_[A-Z][A-Za-z_]*\(' \
    $(ls common/*.[ch] master/*.[ch] worker/*.[ch] config/models/*.[ch] |
        grep -vE '^(master/(post|main)|worker/(collective|node|node_scene|receive|send|work))\.')
check "common/ knows neither side" none '#include "(master|worker)/' common/*.[ch]
check "worker/ does not know master/" none '#include "master/' worker/*.[ch]
check "of master/, only main knows worker/" none '#include "worker/' \
    $(ls master/*.[ch] | grep -v '^master/main\.c$')
check "the queue knows no MPI, no clock, no scene and no thread" none \
    'include.*(mpi|clock|nap|scene|settings|pthread|time)\.h' master/queue*.[ch]
check "no line of a source is longer than 120 characters" none '.{121}' Makefile test/*.sh bench/*.sh \
    $(ls common/*.[ch] master/*.[ch] worker/*.[ch] config/models/*.[ch] test/*.[ch] test/fuzz/*.[ch] bench/*.[ch])
every_bench() {
    listed=$(sed -n '/^BENCHES :=/,/[^\\]$/p' Makefile | tr -s '\\\n ' ' ')
    for target in $(sed -n 's/^\(bench-[a-z-]*\):.*/\1/p' Makefile); do
        [ "$target" = bench-deps ] && continue
        case " $listed " in *" $target "*) ;; *) echo "$target is missing"; return 1 ;; esac
    done
    [ -n "$listed" ]
}
check "make bench makes every bench" every_bench
every_target() { # a word behind make
    make -s help >"$T/help" || return 1
    for target in $(sed -n '/^\.PHONY: all/,/FORCE/p' Makefile | tr -d '\\' | sed 's/^\.PHONY: all//'); do
        [ "$target" = FORCE ] || grep -Eq "make (deps )?$target( |\)|\$)" "$T/help" ||
            { echo "$target is missing"; return 1; }
    done
}
check "make help tells of every target" every_target
uninstalls() {
    make -s install DESTDIR="$T/root" PREFIX=/usr &&
        "$T/root/usr/bin/farm" --check "$T/root/usr/share/farm/config/hello.ini" &&
        touch "$T/root/usr/share/other" && make -s uninstall DESTDIR="$T/root" PREFIX=/usr &&
        [ "$(find "$T/root" ! -type d)" = "$T/root/usr/share/other" ] && [ ! -e "$T/root/usr/share/farm" ]
}
check "make uninstall removes what make install has put there, and nothing else" uninstalls
anchors() { # PAGE: what GitHub makes of its headings
    awk '/^```/ { code = !code }
        !code && sub(/^#+ +/, "") {
            $0 = tolower($0); gsub(/[^a-z0-9 _-]/, ""); gsub(/ /, "-")
            print $0 (seen[$0]++ ? "-" seen[$0] - 1 : "")
        }' "$1"
}
files_exist() { # those that pages name
    wrong=0
    for file in $(grep -ohE '`(common|master|worker|config|bench|test)/[A-Za-z0-9_./]+\.[a-z]+`' *.md */*.md |
        tr -d '`'); do
        case $file in bench/out/*) continue ;; esac # what benches write
        [ -e "$file" ] || { echo "$file does not exist"; wrong=1; }
    done
    return $wrong
}
check "every file that a page names is there" files_exist
check "no line of a page's text is longer than 120 characters" none '^[^|].{120}' *.md */*.md
links_lead() {
    wrong=0
    for page in *.md */*.md; do
        for link in $(grep -oE '\]\([^) ]+\)' "$page" | sed 's/^](//; s/)$//' | grep -vE '^https?:'); do
            target=$page
            case $link in '#'*) ;; *) target=$(dirname "$page")/${link%%#*} ;; esac
            case $link in
            *'#'*) anchors "$target" | grep -Fqx -e "${link#*#}" ;;
            *) [ -e "$target" ] ;;
            esac || { echo "$page: $link leads nowhere"; wrong=1; }
        done
    done
    return $wrong
}
check "every link of a page leads to a file or a heading" links_lead
finish
