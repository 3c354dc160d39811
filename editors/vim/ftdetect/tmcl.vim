autocmd BufRead,BufNewFile *.tmc setfiletype tmcl
