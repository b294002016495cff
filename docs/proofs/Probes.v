(* What a probe has found stays so as long as the places on its way stay full: then no last slot closes a circle. *)
Require Import Posts Books.

Section Probes.
Context `{R : roads}.

(* full since n or longer *)
Definition old s n p := full s p /\ since s p <= n.

(* where a probe with the number n goes as long as all on its way are full since n or longer *)
Inductive trail s n (q : nat) : nat -> Prop :=
| first : trail s n q q
| further x y : trail s n q x -> (old s n x -> exists e, head s x = Some e /\ wants e = y) -> trail s n q y.

(* the asker stood in its place when the slot was kept for it, or has given up *)
Definition beside s n f := gone s f = true \/ (old s n (stands (src f)) -> In (src f) (book s (stands (src f)))).
Definition own s q n a := since s q = n -> forall f, kept s q = Some (Pending f) -> a = stands (src f).
Definition by_probe s p f := exists r, trail s (since s p) p r /\ (old s (since s p) r -> r = stands (src f)) /\ beside s (since s p) f.
Definition offer s q v z := exists w, veh w = v /\ trail s (since s q) q z /\ (old s (since s q) z -> head s z = Some w).
Definition reason s p := exists f, In f (book s p) /\ asked s f = true /\ (by_probe s p f \/ offer s p (veh f) (stands (src f))).

(* probes, and what was decided by them *)
Definition good_probe s q n a r z w := n < clock s /\ own s q n a /\ trail s n q r /\ trail s n q z /\ (old s n z -> head s z = Some w).
Definition good_clear s q n := n < clock s /\ exists a r, own s q n a /\ trail s n q r /\ (old s n r -> r = a).
Definition good_wish s q f := stands f = q /\ asked s f = true /\ granted s f = false /\ beside s (since s q) f.
Record meant (s0 s : state) : Prop := {
  i_since : forall p, since s p < clock s;
  i_probe : forall q n a r z w, probe s q n a r z w -> good_probe s q n a r z w;
  i_clear : forall q n, clear s q n -> good_clear s q n;
  i_kept : forall q f, kept s q = Some (Pending f) -> good_wish s q f;
  i_offer : forall q v z, kept s q = Some (Offered v z) -> offer s q v z;
  i_full : forall p, length (book s p) = slots p -> (since s p = 0 /\ book s p = book s0 p) \/ reason s p }.

(* what is old after a step was so before, with the same head *)
Definition ages s t := forall n x, n < clock s -> old t n x -> old s n x /\ head t x = head s x /\ incl (book s x) (book t x).

Lemma trail_ages s t n q x : ages s t -> n < clock s -> trail s n q x -> trail t n q x.
Proof.
  intros A N T. induction T as [|x y T IH H]; [constructor|]. apply (further t n q x y IH). intro O.
  destruct (A n x N O) as (O2 & Hd & _). rewrite Hd. auto.
Qed.

Lemma beside_ages s t n f : ages s t -> n < clock s -> (forall e, gone s e = true -> gone t e = true) -> beside s n f -> beside t n f.
Proof.
  intros A N G [H|H]; [left; auto|right]. intro O. destruct (A _ _ N O) as (O2 & _ & I). auto.
Qed.

Lemma offer_ages s t q v z : ages s t -> since s q < clock s -> since t q = since s q -> offer s q v z -> offer t q v z.
Proof.
  intros A N E (w & V & T & H). exists w. rewrite E. split; [auto|]. split; [eapply trail_ages; eauto|].
  intro O. destruct (A _ _ N O) as (O2 & Hd & _). rewrite Hd. auto.
Qed.

Lemma meant_later s0 s t : meant s0 s -> ages s t ->
  (forall e, gone s e = true -> gone t e = true) -> (forall e, asked s e = true -> asked t e = true) -> clock s <= clock t ->
  (forall p, since t p < clock t) ->
  (forall q f, kept t q = Some (Pending f) ->
    (kept s q = Some (Pending f) /\ since t q = since s q /\ granted t f = granted s f) \/ (since t q = clock s /\ good_wish t q f)) ->
  (forall q v z, kept t q = Some (Offered v z) -> (kept s q = Some (Offered v z) /\ since t q = since s q) \/ offer t q v z) ->
  (forall p, length (book t p) = slots p -> (book t p = book s p /\ since t p = since s p) \/ reason t p) ->
  (forall q n a r z w, probe t q n a r z w -> probe s q n a r z w \/ good_probe t q n a r z w) ->
  (forall q n, clear t q n -> clear s q n \/ good_clear t q n) -> meant s0 t.
Proof.
  intros M A G Q C Si K O F P Cl.
  assert (Own : forall q n a, n < clock s -> own s q n a -> own t q n a).
  { intros q n a N W E f Kf. destruct (K q f Kf) as [(K1 & E1 & _)|(E1 & _)]; [|lia]. apply W; auto. congruence. }
  split; auto.
  - intros q n a r z w H. destruct (P _ _ _ _ _ _ H) as [H'|]; auto.
    destruct (i_probe _ _ M _ _ _ _ _ _ H') as (N & W & T1 & T2 & Hd). repeat split; auto; try lia; try (eapply trail_ages; eauto).
    intro Ol. destruct (A _ _ N Ol) as (O2 & E & _). rewrite E. auto.
  - intros q n H. destruct (Cl _ _ H) as [H'|]; auto.
    destruct (i_clear _ _ M _ _ H') as (N & a & r & W & T1 & E). split; [lia|]. exists a, r. repeat split; auto; try (eapply trail_ages; eauto).
    intro Ol. destruct (A _ _ N Ol) as (O2 & _). auto.
  - intros q f H. destruct (K q f H) as [(K1 & E1 & E2)|[_ ?]]; auto.
    destruct (i_kept _ _ M _ _ K1) as (S1 & S2 & S3 & S4). repeat split; auto; [congruence|]. rewrite E1.
    eapply beside_ages; eauto. apply (i_since _ _ M).
  - intros q v z H. destruct (O _ _ _ H) as [(K1 & E1)|]; auto. eapply offer_ages; eauto; [apply (i_since _ _ M)|]. apply (i_offer _ _ M); auto.
  - intros p L. destruct (F p L) as [(E & E2)|]; auto. rewrite E in L. assert (N := i_since _ _ M p).
    destruct (i_full _ _ M p L) as [(Z & B)|(f & I & Af & D)]; [left; split; congruence|right].
    exists f. rewrite E. split; [auto|split; [auto|]]. destruct D as [(r & T & H & B)|D]; [left|right].
    + exists r. rewrite E2. split; [eapply trail_ages; eauto|]. split; [|eapply beside_ages; eauto].
      intro Ol. destruct (A _ _ N Ol) as (O2 & _). auto.
    + eapply offer_ages; eauto.
Qed.

Lemma ages_same s t : book t = book s -> kept t = kept s -> since t = since s -> ages s t.
Proof. intros E1 E2 E3 n x _ [F L]. unfold old, full, head, held in *. rewrite E1, E2, E3 in *. repeat split; auto. apply incl_refl. Qed.

Lemma sound_step s0 s t : sound s -> meant s0 s -> step s t -> sound t.
Proof.
  intros I M St. destruct St.
  - apply sound_ask; auto.
  - apply sound_go; auto.
  - apply sound_give_up; auto.
  - apply sound_leave; auto.
  - apply sound_admit; auto.
  - apply (sound_say s); auto; intro p; simpl; unfold held; simpl; assert (Q := i_room _ I p); assert (L := i_last _ I p); unfold held in Q.
    + unfold upd. destruct (Nat.eq_dec p (stands f)) as [->|]; [lia|]. destruct (kept s p); lia.
    + unfold upd. destruct (Nat.eq_dec p (stands f)) as [->|]; auto.
  - apply (sound_say s); auto; [|apply (i_last _ I)]. intro p. assert (Q := i_room _ I p). unfold held in *. simpl. destruct (kept s p); lia.
  - apply (sound_say s); auto; [|apply (i_last _ I)]. intro p. assert (Q := i_room _ I p). unfold held in *. simpl. destruct (kept s p); lia.
  - destruct (i_kept _ _ M _ _ H0) as (<- & Af & Gf & _). destruct (i_last _ I (stands f)) as [L Se]; [congruence|].
    apply sound_admit; auto. assert (Q := i_room _ I (stands f)). unfold held in Q. rewrite H0 in Q. lia.
  - assert (K : kept s q <> None) by congruence. apply (sound_say s); auto; intro p; simpl; unfold held; simpl;
      assert (Q := i_room _ I p); assert (L := i_last _ I p); unfold held in Q.
    + unfold upd. destruct (Nat.eq_dec p q) as [->|]; [rewrite H0 in Q; lia|]. destruct (kept s p); lia.
    + unfold upd. destruct (Nat.eq_dec p q) as [->|]; auto.
  - destruct (i_last _ I (stands f)) as [L Se]; [congruence|].
    apply sound_admit; auto. assert (Q := i_room _ I (stands f)). unfold held in Q. rewrite H in Q. lia.
  - apply (sound_say s); auto; intro p; simpl; unfold held; simpl; assert (Q := i_room _ I p); assert (L := i_last _ I p); unfold held in Q.
    + unfold upd. destruct (Nat.eq_dec p q) as [->|]; [lia|]. destruct (kept s p); lia.
    + unfold upd. destruct (Nat.eq_dec p q) as [->|]; auto.
  - apply sound_hear_gone; auto.
  - apply sound_hear_out; auto.
Qed.

Lemma ages_admit f s : kept s (stands f) <> None \/ S (length (book s (stands f))) < slots (stands f) -> ages s (admit f s).
Proof.
  intros H n x _ [F L]. unfold old, full, head, held in *. simpl in *. unfold upd in *.
  destruct (Nat.eq_dec x (stands f)) as [->|N].
  - rewrite app_length in F. simpl in F. destruct H as [H|H]; [|lia]. destruct (kept s (stands f)); [|contradiction].
    assert (W := wide (stands f)). destruct (book s (stands f)) eqn:E; simpl in *; [lia|]. repeat split; auto; try lia.
    intros y [->|Y]; [left; auto|right; apply in_or_app; auto].
  - repeat split; auto. apply incl_refl.
Qed.

Lemma ages_keep f h s : ages s (keep f h s).
Proof.
  intros n x N [F L]. unfold old, full, head, held in *. simpl in *. unfold upd in *.
  destruct (Nat.eq_dec x (stands f)) as [->|Np]; [lia|]. repeat split; auto. apply incl_refl.
Qed.

Lemma ages_kept q k s : kept s q <> None \/ k = None -> ages s (set_kept q k s).
Proof.
  intros H n x N [F L]. unfold old, full, head, held in *. simpl in *. unfold upd in *.
  split; [|split; [auto|apply incl_refl]]. split; auto.
  destruct (Nat.eq_dec x q) as [->|Np]; auto. destruct H as [H| ->]; [|lia].
  destruct (kept s q); [|contradiction]. destruct k; lia.
Qed.

Lemma ages_hear_gone e p s : sound s -> In e (book s p) -> ages s (hear_gone e p s).
Proof.
  intros I H n x N [F L]. unfold old, full, head, held in *. simpl in *. unfold upd in *.
  destruct (Nat.eq_dec x p) as [->|Np]; [|repeat split; auto; apply incl_refl].
  assert (W := remove_length_lt Nat.eq_dec _ _ H). assert (Q := i_room _ I p). lia.
Qed.

Lemma meant_admit s0 f s : sound s -> meant s0 s -> granted s f = false -> kept s (stands f) <> None \/ S (length (book s (stands f))) < slots (stands f) ->
  (length (book s (stands f) ++ [f]) = slots (stands f) -> reason (admit f s) (stands f)) -> meant s0 (admit f s).
Proof.
  intros I M G H F. apply (meant_later s0 s); auto; simpl.
  - apply ages_admit; auto.
  - apply M.
  - intros q g K. unfold upd in K. destruct (Nat.eq_dec q (stands f)); [discriminate|]. left. split; auto. split; auto.
    destruct (i_kept _ _ M _ _ K) as (E & _). cases; congruence.
  - intros q v z K. unfold upd in K. destruct (Nat.eq_dec q (stands f)); [discriminate|]. auto.
  - intros p L. unfold upd in *. destruct (Nat.eq_dec p (stands f)) as [->|]; auto.
Qed.

Lemma meant_same s0 s t : meant s0 s -> book t = book s -> kept t = kept s -> since t = since s -> granted t = granted s ->
  (forall e, gone s e = true -> gone t e = true) -> (forall e, asked s e = true -> asked t e = true) -> clock t = clock s ->
  (forall q n a r z w, probe t q n a r z w -> probe s q n a r z w \/ good_probe t q n a r z w) ->
  (forall q n, clear t q n -> clear s q n \/ good_clear t q n) -> meant s0 t.
Proof.
  intros M E1 E2 E3 E4 G A E5 P C. apply (meant_later s0 s); auto; rewrite ?E1, ?E2, ?E3, ?E4, ?E5; auto.
  - apply ages_same; auto.
  - apply M.
Qed.

Lemma meant_step s0 s t : sound s -> meant s0 s -> step s t -> meant s0 t.
Proof.
  intros I M St. destruct St.
  - apply (meant_same s0 s); auto. simpl. intro e. cases; auto.
  - apply (meant_same s0 s); auto. simpl. intros e ->. auto.
  - apply (meant_same s0 s); auto. simpl. intro e. cases; auto.
  - apply (meant_same s0 s); auto.
  - apply meant_admit; auto. rewrite app_length. simpl. intro. lia.
  - (* the slot is kept, and the probe begins *)
    apply (meant_later s0 s); auto; simpl.
    + apply ages_keep.
    + lia.
    + intro p. assert (N := i_since _ _ M p). cases; lia.
    + intros q g. unfold good_wish; simpl. unfold upd. destruct (Nat.eq_dec q (stands f)) as [->|Nq]; [|auto]. intros [= <-].
      right. repeat split; auto. destruct (i_asked _ I f H) as (_ & _ & _ & [X|[[X _]|(_ & _ & X)]]).
      * left. auto.
      * rewrite (i_used _ I f X) in H0. discriminate.
      * right. intros _. apply (in_queue s _ _ I). apply first_in. auto.
    + intros q v z. unfold upd. destruct (Nat.eq_dec q (stands f)) as [->|Nq]; [discriminate|auto].
    + intros p L. left. unfold upd. destruct (Nat.eq_dec p (stands f)) as [->|Np]; [lia|auto].
    + intros q n a r z w [P|(-> & -> & -> & -> & -> & ->)]; auto. right. repeat split; simpl; auto.
      * intros _ g. simpl. unfold upd. destruct (Nat.eq_dec (stands f) (stands f)); [|contradiction]. intros [= <-]. auto.
      * apply (further _ _ _ (stands f)); [constructor|]. intros _. exists h. auto.
      * constructor.
  - (* the probe goes on *)
    apply (meant_same s0 s); auto. simpl. intros q' n' a' r' z' w' [P|(-> & -> & -> & -> & -> & ->)]; auto. right.
    destruct (i_probe _ _ M _ _ _ _ _ _ H) as (N & O & T & _ & _).
    assert (T2 : trail (say_probe q n a (wants h) r h s) n q r) by (apply (trail_ages s); auto; apply ages_same; auto).
    repeat split; simpl; auto. apply (further _ _ _ r); auto. intros _. exists h. auto.
  - (* it ends *)
    apply (meant_same s0 s); auto. simpl. intros q' n' [C|(-> & ->)]; auto. right.
    destruct (i_probe _ _ M _ _ _ _ _ _ H) as (N & O & T & _ & _).
    split; auto. exists a, r. split; [auto|]. split; [apply (trail_ages s); auto; apply ages_same; auto|].
    intros [F _]. destruct H1; auto. contradiction.
  - (* the answer comes *)
    destruct (i_kept _ _ M _ _ H0) as (<- & Af & Gf & B). assert (N := i_since _ _ M (stands f)).
    assert (A : ages s (admit f s)) by (apply ages_admit; left; congruence).
    apply meant_admit; auto; [left; congruence|]. intros _. exists f. split; [simpl; cases; [apply in_or_app; right; left; auto|contradiction]|].
    split; auto. left. destruct (i_clear _ _ M _ _ H) as (_ & a & r & O & T & E). exists r. split; [apply (trail_ages s); auto|].
    split; [|apply (beside_ages s); auto]. intro Ol. destruct (A _ _ N Ol) as (O2 & _ & _). rewrite (E O2). apply O; auto.
  - (* the probe comes back *)
    assert (A : ages s (set_kept q (Some (Offered (veh w) z)) s)) by (apply ages_kept; left; congruence).
    assert (N := i_since _ _ M q).
    apply (meant_later s0 s); auto; simpl.
    + apply M.
    + intros q' g. unfold upd. destruct (Nat.eq_dec q' q) as [->|Nq]; [discriminate|auto].
    + intros q' v z'. unfold upd. destruct (Nat.eq_dec q' q) as [->|Nq]; [|auto]. intros [= <- <-]. right.
      destruct (i_probe _ _ M _ _ _ _ _ _ H) as (_ & _ & _ & T & E). exists w. split; auto. simpl. split; [apply (trail_ages s); auto|].
      intro Ol. destruct (A _ _ N Ol) as (O2 & Hd & _). rewrite Hd. auto.
  - (* who brought it gets the slot *)
    assert (A : ages s (admit f s)) by (apply ages_admit; left; congruence).
    apply meant_admit; auto; [left; congruence|]. intros _. exists f. split; [simpl; cases; [apply in_or_app; right; left; auto|contradiction]|].
    split; auto. right. rewrite H2, H3. apply (offer_ages s); auto; [apply M|]. apply (i_offer _ _ M); auto.
  - (* the slot is kept no longer *)
    apply (meant_later s0 s); auto; simpl.
    + apply ages_kept; auto.
    + apply M.
    + intros q' g. unfold upd. destruct (Nat.eq_dec q' q) as [->|Nq]; [discriminate|auto].
    + intros q' v z'. unfold upd. destruct (Nat.eq_dec q' q) as [->|Nq]; [discriminate|auto].
  - apply (meant_later s0 s); auto; simpl.
    + apply ages_hear_gone; auto.
    + apply M.
    + intros q' g. unfold upd. destruct (Nat.eq_dec q' p) as [->|Nq]; [discriminate|auto].
    + intros q' v z'. unfold upd. destruct (Nat.eq_dec q' p) as [->|Nq]; [discriminate|auto].
    + intros r. unfold upd. destruct (Nat.eq_dec r p) as [->|Nr]; auto. intro L.
      assert (W := remove_length_lt Nat.eq_dec _ _ H). assert (Q := i_room _ I p). lia.
  - apply (meant_same s0 s); auto.
Qed.

Lemma start_holds s : start s -> sound s /\ meant s s.
Proof.
  intros (P & E & One & Pr & Cl & Ck & _). split; constructor.
  - intros e p [H|H]; destruct (P p) as (_ & _ & Re & _ & _ & _ & St); [|rewrite Re in H; destruct H].
    rewrite (St e H). split; auto. apply E. rewrite (St e H). auto.
  - intro p. destruct (P p) as (_ & N & -> & _). rewrite app_nil_r. auto.
  - intro p. unfold held. destruct (P p) as (L & _ & -> & -> & _). simpl. lia.
  - intro p. destruct (P p) as (_ & _ & _ & -> & _). congruence.
  - intro p. exists (book s p), []. rewrite app_nil_r. split; auto. split; [|auto]. intros e H. left.
    destruct (E e) as (G & -> & _). apply G. destruct (P p) as (_ & _ & _ & _ & _ & _ & St). rewrite (St e H). auto.
  - intro p. destruct (P p) as (_ & _ & _ & _ & _ & -> & St).
    assert (All : forall e, In e (book s p) -> used s e && negb (gone s e) = true).
    { intros e H. destruct (E e) as (G & -> & _ & -> & _). rewrite (proj2 G); auto. rewrite (St e H). auto. }
    revert All. generalize (book s p). induction l as [|x l IH]; simpl; intro All; auto. rewrite All; auto. f_equal. auto.
  - intros e U. destruct (E e) as (_ & <- & _). auto.
  - intros e O. destruct (E e) as (_ & _ & _ & _ & X). congruence.
  - intros e p H. destruct (P p) as (_ & _ & Re & _). rewrite Re in H. destruct H.
  - intros e G _. left. apply E. auto.
  - intros e A. destruct (E e) as (_ & _ & X & _). congruence.
  - intros e f U V _ _ W. auto.
  - intro p. destruct (P p) as (_ & _ & _ & _ & -> & _). lia.
  - intros q n a r z w H. destruct (Pr _ _ _ _ _ _ H).
  - intros q n H. destruct (Cl _ _ H).
  - intros q f K. destruct (P q) as (_ & _ & _ & X & _). congruence.
  - intros q v z K. destruct (P q) as (_ & _ & _ & X & _). congruence.
  - intros p _. left. destruct (P p) as (_ & _ & _ & _ & X & _). auto.
Qed.

Lemma reached_holds s0 s : reached s0 s -> start s0 /\ sound s /\ meant s0 s.
Proof.
  induction 1 as [H|s t R' IH St]; [destruct (start_holds _ H); auto|]. destruct IH as (S0 & I & M).
  split; auto. split; [eapply sound_step; eauto|eapply meant_step; eauto].
Qed.

Lemma trail_in s C n q x : stuck s C -> (forall r, In r C -> old s n r) -> In q C -> trail s n q x -> In x C.
Proof.
  intros [_ J] O Q T. induction T as [|x y T IH H]; auto. destruct (H (O x IH)) as (e & Hd & <-).
  destruct (J x IH) as (_ & _ & e' & Hd' & W & _). congruence.
Qed.

(* in such a circle the head of the books is the first of those who stand there *)
Lemma front s C z e : sound s -> stuck s C -> In z C -> head s z = Some e -> hd_error (queue s z) = Some e.
Proof.
  intros I [_ J] Z Hd. destruct (J z Z) as (L & G & _). rewrite (i_queue _ I). unfold head in Hd.
  destruct (i_known _ I z) as (l & m & E & Se & Lm). assert (W := wide z). rewrite E in *. destruct l as [|x l]; [simpl in *; lia|].
  simpl in *. injection Hd as ->. destruct (Se e) as [U|U]; [left; auto| |rewrite G in U; auto; discriminate].
  rewrite U, G; auto.
Qed.

Lemma no_reason s0 s C p : sound s -> meant s0 s -> stuck s C -> In p C -> (forall r, In r C -> since s r <= since s p) -> ~ reason s p.
Proof.
  intros I M K Cp Most (f & Bf & Af & D). assert (O : forall r, In r C -> old s (since s p) r).
  { intros r Cr. split; auto. destruct K as [_ J]. destruct (J r Cr) as (L & _). unfold full. lia. }
  destruct (i_asked _ I f Af) as (Wf & Vf & Ua & T). destruct (i_place _ I f p) as [Sp _]; auto.
  assert (Gf : gone s f = false) by (destruct K as [_ J]; apply (J p Cp); auto).
  assert (X : In (stands (src f)) C /\ head s (stands (src f)) = Some (src f)).
  { destruct D as [(r & Tr & E & B)|(w & V & Tr & E)].
    - assert (Cr := trail_in s C _ p r K O Cp Tr). rewrite (E (O r Cr)) in Cr. split; auto. destruct B as [B|B]; [congruence|].
      specialize (B (O _ Cr)). destruct T as [T|[[_ T]|(_ & _ & T)]]; [congruence| |].
      + destruct K as [_ J]. destruct (J _ Cr) as (_ & G & _). rewrite G in T; auto. discriminate.
      + assert (Y := K). destruct Y as [_ J]. destruct (J _ Cr) as (_ & _ & e & Hd & _). rewrite (front s C _ e I K Cr Hd) in T. congruence.
    - assert (Cr := trail_in s C _ p _ K O Cp Tr). split; auto. assert (Hd := E (O _ Cr)).
      assert (F := front s C _ w I K Cr Hd). destruct (in_queue s _ _ I (first_in _ _ F)) as (Bw & Uw & Gw).
      destruct T as [T|[[T T2]|(_ & _ & T)]]; [congruence| |congruence].
      assert (f = w) by (apply (i_one _ I); auto). subst w. destruct (i_place _ I f (stands (src f))) as [Y _]; auto.
      exfalso. apply (no_self (src f)). congruence. }
  destruct X as [Cr Hd]. destruct K as [_ J]. destruct (J _ Cr) as (_ & _ & e & Hd' & _ & No).
  assert (e = src f) by congruence. subst e. apply (No f); auto. rewrite <- Wf, Sp. auto.
Qed.

Lemma latest s (C : list nat) : C <> [] -> exists p, In p C /\ forall r, In r C -> since s r <= since s p.
Proof.
  induction C as [|x C IH]; [contradiction|]. intros _. destruct C as [|y C].
  - exists x. split; [left; auto|]. intros r [<-|[]]. auto.
  - destruct IH as (p & Cp & H); [discriminate|]. destruct (le_lt_dec (since s x) (since s p)).
    + exists p. split; [right; auto|]. intros r [<-|Cr]; auto.
    + exists x. split; [left; auto|]. intros r [<-|Cr]; auto. specialize (H r Cr). lia.
Qed.

(* no circle of full places is ever closed *)
Theorem no_circle s0 s C : reached s0 s -> ~ stuck s C.
Proof.
  intros Re K. destruct (reached_holds _ _ Re) as (S0 & I & M). assert (Y := K). destruct Y as [Ne J].
  destruct (latest s C Ne) as (p & Cp & Most).
  assert (No := no_reason s0 s C p I M K Cp Most). destruct (J p Cp) as (L & _).
  destruct (i_full _ _ M p L) as [[Z _]|?]; [|contradiction].
  assert (Same : forall r, In r C -> book s r = book s0 r).
  { intros r Cr. destruct (J r Cr) as (Lr & _). destruct (i_full _ _ M r Lr) as [[_ B]|D]; auto. exfalso.
    apply (no_reason s0 s C r I M K Cr); auto. intros x Cx. specialize (Most x Cx). lia. }
  destruct S0 as (_ & E & _ & _ & _ & _ & N). apply (N C). split; auto. intros r Cr.
  destruct (J r Cr) as (Lr & _ & e & Hd & W & _). unfold head. rewrite <- (Same r Cr). split; [auto|]. split; [intros x _; apply E|].
  exists e. split; [auto|split; [auto|]]. intros f _ A. destruct (E f) as (_ & _ & X & _). congruence.
Qed.

(* no slot is given twice: who was let in and is not out, and the slot that is kept, are never more than the place holds *)
Theorem no_slot_twice s0 s p l : reached s0 s -> NoDup l -> (forall e, In e l -> stands e = p /\ granted s e = true /\ out s e = false) ->
  length l + held s p <= slots p.
Proof.
  intros Re N H. destruct (reached_holds _ _ Re) as (_ & I & _). assert (Q := i_room _ I p).
  assert (L : length l <= length (book s p ++ rears s p)).
  { apply NoDup_incl_length; auto. intros e J. destruct (H e J) as (<- & G & O). apply in_or_app. apply (i_space _ I); auto. }
  rewrite app_length in L. lia.
Qed.
End Probes.
Print Assumptions no_circle.
Print Assumptions no_slot_twice.
